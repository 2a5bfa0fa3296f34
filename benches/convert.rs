//! Conversions, each beside what the standard library would be used for.

#![expect(clippy::cast_possible_truncation, reason = "what others write")]

mod common;

use criterion::{BenchmarkId, Criterion, Throughput};
use halfplane::glam::Vec4;
use halfplane::{floor_to_i32, linear_to_srgb8, pack_rgb565, pack_rgba8, pack_srgba8, srgb8_to_linear, wrap};

const COUNT: usize = 4096;

fn main() {
    common::run(|criterion| {
        // A little of it lies outside of 0 ..= 1.
        let mut random = common::Random(1);
        let mut channel = || random.unit() * 1.2 - 0.1;
        let colors: Vec<Vec4> = (0..COUNT).map(|_| Vec4::from_array([(); 4].map(|()| channel()))).collect();
        let numbers: Vec<f32> = colors.iter().map(|color| color.x * 1000.0).collect();
        let bytes: Vec<u8> = colors.iter().map(|color| linear_to_srgb8(color.x)).collect();

        pair(criterion, "pack_rgba8", &colors, pack_rgba8, |color| {
            u32::from_le_bytes(color.to_array().map(|x| byte(x.clamp(0.0, 1.0))))
        });
        pair(
            criterion,
            "pack_rgb565",
            &colors,
            |color| pack_rgb565(color.truncate()),
            |color| {
                let part = |x: f32, max: f32| (x.clamp(0.0, 1.0) * max).round_ties_even() as u16;
                part(color.x, 31.0) << 11 | part(color.y, 63.0) << 5 | part(color.z, 31.0)
            },
        );
        pair(criterion, "pack_srgba8", &colors, pack_srgba8, |color| {
            let [r, g, b, a] = color.to_array().map(|x| x.clamp(0.0, 1.0));
            u32::from_le_bytes([byte(power(r)), byte(power(g)), byte(power(b)), byte(a)])
        });
        // The same of numbers that can be lanes, as in a closure.
        let arrays: Vec<[f32; 4]> = colors.iter().map(Vec4::to_array).collect();
        pair(
            criterion,
            "pack_srgba8_of_arrays",
            &arrays,
            |color| pack_srgba8(Vec4::from_array(color)),
            |color| {
                let [r, g, b, a] = color.map(|x| x.clamp(0.0, 1.0));
                u32::from_le_bytes([byte(power(r)), byte(power(g)), byte(power(b)), byte(a)])
            },
        );
        pair(
            criterion,
            "linear_to_srgb8",
            &numbers,
            |x| linear_to_srgb8(x * 1e-3),
            |x| byte(power((x * 1e-3).clamp(0.0, 1.0))),
        );
        pair(criterion, "srgb8_to_linear", &bytes, srgb8_to_linear, |byte| {
            let x = f64::from(byte) / 255.0;
            (if x <= 0.04045 { x / 12.92 } else { ((x + 0.055) / 1.055).powf(2.4) }) as f32
        });
        pair(criterion, "floor_to_i32", &numbers, floor_to_i32, |x| x.floor() as i32);
        pair(criterion, "wrap", &numbers, wrap, |x| x - x.floor());
    });
}

fn byte(x: f32) -> u8 {
    (x * 255.0).round_ties_even() as u8
}

fn power(x: f32) -> f32 {
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

/// One of ours and the same by the standard library, which must give the same results.
fn pair<T: Copy + core::fmt::Debug, U: Copy + Default + PartialEq + core::fmt::Debug>(
    criterion: &mut Criterion,
    name: &str,
    from: &[T],
    ours: impl Fn(T) -> U,
    other: impl Fn(T) -> U,
) {
    for &x in from {
        assert_eq!(ours(x), other(x), "{name} of {x:?}");
    }
    let mut to = vec![U::default(); from.len()];
    let mut group = criterion.benchmark_group("convert");
    group.throughput(Throughput::Elements(from.len() as u64));
    group.bench_function(BenchmarkId::new(name, "halfplane"), |bencher| {
        bencher.iter(|| {
            for (to, &from) in to.iter_mut().zip(from) {
                *to = ours(from);
            }
            core::hint::black_box(&mut to);
        });
    });
    group.bench_function(BenchmarkId::new(name, "std"), |bencher| {
        bencher.iter(|| {
            for (to, &from) in to.iter_mut().zip(from) {
                *to = other(from);
            }
            core::hint::black_box(&mut to);
        });
    });
}
