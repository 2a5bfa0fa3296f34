//! Traversal alone: `Setup::for_each_span`, per covered sample.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput};
use halfplane::{ProjectedVertex, Rect, SUBPIXELS, Setup};

fn main() {
    common::run(|criterion| {
        for size in [4, 8, 16, 32, 64, 128, 256, 512, 1024] {
            // The samples on the slanted side belong to the neighbour.
            let samples = size * (size - 1) / 2;
            let corners = [common::vertex(0, 0), common::vertex(0, size), common::vertex(size, 0)];
            bench(criterion, "right_triangle", size, corners, Some(samples));
        }
        for size in [32, 1024] {
            // Pointed below, four pixels wide above.
            let vertex =
                |x: i32, y: i32| ProjectedVertex::new(x, y, 0.5, 1.0).expect("inside the guard band");
            let size_subpixel = size * SUBPIXELS;
            let corners = [vertex(0, 0), vertex(size_subpixel, size_subpixel), vertex(4 * SUBPIXELS, 0)];
            bench(criterion, "sliver", size, corners, None);
        }
    });
}

fn bench(
    criterion: &mut Criterion,
    shape: &str,
    size: i32,
    corners: [ProjectedVertex; 3],
    samples: Option<i32>,
) {
    let setup = Setup::new(corners).expect("it has an area");
    let area = Rect::of_size(size.unsigned_abs(), size.unsigned_abs());
    let mut by_definition = 0;
    for y in 0..size {
        by_definition += (0..size).filter(|&x| setup.edges().iter().all(|edge| edge.covers(x, y))).count();
    }
    let traverse = |setup: &Setup| {
        let mut covered = 0;
        setup.for_each_span(area, |span| covered += span.end() - span.start());
        covered
    };
    let covered = traverse(&setup);
    assert_eq!(covered.unsigned_abs() as usize, by_definition, "{shape} of {size}");
    assert_eq!(covered, samples.unwrap_or(covered), "{shape} of {size}");
    criterion
        .benchmark_group("traverse")
        .throughput(Throughput::Elements(by_definition as u64))
        .bench_function(BenchmarkId::new(shape, size), |bencher| {
            bencher.iter(|| traverse(core::hint::black_box(&setup)))
        });
}
