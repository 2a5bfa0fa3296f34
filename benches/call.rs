//! What a draw call costs: many squares, each in a draw of its own, as sprites and letters are, and all in one.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput};
use halfplane::glam::Vec4;
use halfplane::{Fragment, LessOrEqual, Primitives, Rasterizer, Record, Rect, Statistics, Surface, Viewport};

/// The frame's side, and how many squares there are, of two triangles.
const SIZE: u16 = 512;
const COUNT: u16 = 256;

fn main() {
    common::run(|criterion| {
        for side in [4, 16, 64] {
            bench(criterion, side);
        }
    });
}

/// Squares of `side` pixels, along the frame's diagonal.
fn bench(criterion: &mut Criterion, side: u16) {
    let at = |pixel: u16| f32::from(pixel) / f32::from(SIZE) * 2.0 - 1.0;
    let squares: Vec<[Vec4; 6]> = (0..COUNT)
        .map(|i| {
            let left = u32::from(i) * u32::from(SIZE - side) / u32::from(COUNT);
            let left = u16::try_from(left).expect("inside the frame");
            let (low, high) = (at(left), at(left + side));
            let corners = [(low, low), (high, low), (low, high), (low, high), (high, low), (high, high)];
            corners.map(|(x, y)| Vec4::new(x, y, 0.5, 1.0))
        })
        .collect();
    let positions = squares.as_flattened();
    let size = u32::from(SIZE);
    let rasterizer = Rasterizer::<()>::new(Viewport::of_size(size, size).expect("a small size"))
        .with_depth_test(LessOrEqual);
    let mut records = vec![Record::default(); 2 * usize::from(COUNT)];
    let records = rasterizer
        .prepare(Rect::of_size(size, size), Primitives::list(), positions, ())
        .and_then(|mut preparation| preparation.fill(&mut records).map(Option::unwrap_or_default))
        .expect("there is room");
    let (mut color, mut depth) = (vec![0u32; (size * size) as usize], vec![1.0; (size * size) as usize]);
    let mut target = Surface::new(&mut color, &mut depth, size, size).expect("of this size");

    let mut group = criterion.benchmark_group("call");
    group.throughput(Throughput::Elements(u64::from(COUNT)));
    let mut measure = |name: &str, draw_all: &mut dyn FnMut() -> Statistics| {
        let samples = u64::from(COUNT) * u64::from(side) * u64::from(side);
        assert_eq!(draw_all().samples_passed, samples, "{name} of {side}");
        group.bench_function(BenchmarkId::new(name, side), |bencher| bencher.iter(&mut *draw_all));
    };
    let shade = |fragment: Fragment<'_, ()>| fragment.x().unsigned_abs();
    let sum = |mut all: Statistics, one| {
        all += one;
        all
    };
    measure("each", &mut || {
        let draw = |square: &[Vec4; 6]| rasterizer.draw(&mut target, Primitives::list(), square, (), shade);
        squares.iter().map(draw).map(|drawn| drawn.expect("no indices")).fold(Statistics::default(), sum)
    });
    measure("each_depth", &mut || {
        let draw = |square: &[Vec4; 6]| rasterizer.draw_depth(&mut target, Primitives::list(), square);
        squares.iter().map(draw).map(|drawn| drawn.expect("no indices")).fold(Statistics::default(), sum)
    });
    measure("each_prepared", &mut || {
        let draw = |square| rasterizer.draw_prepared(&mut target, square, shade);
        records.chunks(2).map(draw).fold(Statistics::default(), sum)
    });
    measure("all", &mut || {
        rasterizer.draw(&mut target, Primitives::list(), positions, (), shade).expect("no indices")
    });
}
