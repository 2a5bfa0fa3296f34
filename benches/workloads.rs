//! W1 to W8 whole, as the peers draw them, and the time without clearing; W7 and W8 also without reading each tile first; and the
//! least that W1 could take: a loop that compares each depth and writes it and a colour.

mod common;
#[path = "workloads/draw.rs"]
#[allow(unreachable_pub, reason = "the peers share it")]
mod draw;
#[path = "../examples/support"]
mod support {
    #![allow(dead_code, missing_docs, unreachable_pub, reason = "written for the examples")]
    pub mod mesh;
    pub mod teapot;
}
#[path = "workloads/mod.rs"]
mod workloads;

use core::time::Duration;
use std::time::Instant;

use criterion::{Bencher, BenchmarkId, Throughput};

use draw::Canvas;
use workloads::{HEIGHT, Mesh, WIDTH, Workload};

/// Samples that pass the depth test.
const FRAGMENTS: [(&str, u64); 9] = [
    ("W1", 2_073_600),
    ("W2f", 2_073_600),
    ("W2b", 16_588_800),
    ("W3", 586_291),
    ("W4", 586_299),
    ("W5", 586_291),
    ("W6", 1_316_616),
    ("W7", 10_695_341),
    ("W8", 7_658_879),
];

fn main() {
    common::run(|criterion| {
        let mut canvas = Canvas::new();
        check_fill(&mut canvas);
        let mut group = criterion.benchmark_group("draw");
        group.throughput(Throughput::Elements(u64::from(WIDTH * HEIGHT)));
        group.bench_function(BenchmarkId::new("limit", format!("{WIDTH}x{HEIGHT}")), |bencher| {
            time_frames(bencher, &mut canvas, |canvas| fill(&mut canvas.color, &mut canvas.depth));
        });
        drop(group);
        for (name, expected) in FRAGMENTS {
            // Without optimization the others take longer than all tests.
            if cfg!(debug_assertions) && !matches!(name, "W1" | "W3" | "W5") {
                continue;
            }
            let workload = Workload::new(name, teapot).expect("one of the names");
            canvas.prepare(&workload);
            let samples = check(&mut canvas, &workload);
            assert!(samples.abs_diff(expected) <= expected / 10_000, "{name}: {samples} samples");
            let mut group = criterion.benchmark_group("draw");
            group.throughput(Throughput::Elements(samples));
            let mut time = |name: &str, canvas: &mut Canvas| {
                group.bench_function(BenchmarkId::new(name, format!("{WIDTH}x{HEIGHT}")), |bencher| {
                    time_frames(bencher, canvas, |canvas| {
                        canvas.draw(&workload, 0..HEIGHT);
                    });
                });
            };
            time(name, &mut canvas);
            if matches!(name, "W7" | "W8") {
                canvas.prefetches = false;
                assert_eq!(check(&mut canvas, &workload), samples, "{name} without");
                time(&format!("{name}_not_prefetched"), &mut canvas);
                canvas.prefetches = true;
            }
        }
    });
}

/// The time of a frame without clearing.
fn time_frames(bencher: &mut Bencher<'_>, canvas: &mut Canvas, mut draw: impl FnMut(&mut Canvas)) {
    bencher.iter_custom(|frames| {
        let mut time = Duration::ZERO;
        for _ in 0..frames {
            canvas.clear();
            let start = Instant::now();
            draw(canvas);
            time += start.elapsed();
        }
        time
    });
}

/// What [`fill`] writes.
const NEAR: (u32, f32) = (0xFF7A_4A28, 0.5);

/// Compares each depth with a constant, and where that is less, writes it and a colour.
#[inline(never)]
fn fill(color: &mut [u32], depth: &mut [f32]) {
    for (color, depth) in color.iter_mut().zip(depth) {
        let passes = NEAR.1 < *depth;
        *color = if passes { NEAR.0 } else { *color };
        *depth = if passes { NEAR.1 } else { *depth };
    }
}

/// Fills a frame whose upper half is nearer.
fn check_fill(canvas: &mut Canvas) {
    canvas.clear();
    let half = canvas.depth.len() / 2;
    canvas.depth[..half].fill(0.25);
    let cleared = canvas.color[0];
    fill(&mut canvas.color, &mut canvas.depth);
    let pixels = || canvas.color.iter().zip(&canvas.depth);
    assert!(pixels().take(half).all(|pixel| pixel == (&cleared, &0.25)), "what is nearer stays");
    assert!(pixels().skip(half).all(|pixel| pixel == (&NEAR.0, &NEAR.1)), "what is farther is replaced");
}

/// The mesh of W6.
fn teapot() -> Mesh {
    let support::mesh::Mesh { positions, normals, uvs, indices } = support::teapot::tessellate(40, |_, _| {});
    Mesh { positions, normals, uvs, indices }
}

/// Draws it whole and in three bands, which must give the same bits; how many samples passed. (That it is the right picture
/// is what `benches/peers` asks the others.)
fn check(canvas: &mut Canvas, workload: &Workload) -> u64 {
    canvas.clear();
    let samples = canvas.draw(workload, 0..HEIGHT).samples_passed;
    let whole = (canvas.color.clone(), canvas.depth.clone());
    canvas.clear();
    let bands = [0..1, 1..601, 601..HEIGHT];
    let in_bands: u64 = bands.map(|rows| canvas.draw(workload, rows).samples_passed).iter().sum();
    assert_eq!(samples, in_bands, "{}", workload.name);
    let bits = |depth: &[f32]| depth.iter().map(|depth| depth.to_bits()).collect::<Vec<_>>();
    let is_same = canvas.color == whole.0 && bits(&canvas.depth) == bits(&whole.1);
    assert!(is_same, "{}: another picture in bands", workload.name);
    samples
}
