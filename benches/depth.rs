//! Draws of depth alone: all samples pass, none does, or every second column does; in each format. And draws behind what
//! is there, with coarse depth and without; of small triangles, with a test that says what it compares and one that does not.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput};
use halfplane::glam::Vec4;
use halfplane::{
    CoarseDepth, Depth24, DepthFormat, DepthTest, Fragment, Greater, Less, LessOrEqual, Primitives,
    Rasterizer, ReadOnly, Rect, Statistics, Surface, Viewport,
};

fn main() {
    common::run(|criterion| {
        for size in [4, 16, 64, 256, 1024] {
            format::<f32>(criterion, "f32", size);
        }
        for size in [64, 1024] {
            format::<u16>(criterion, "u16", size);
            format::<Depth24>(criterion, "depth24", size);
            format::<u32>(criterion, "u32", size);
        }
        for size in [64, 256, 1024] {
            hidden(criterion, size);
        }
        for side in [2, 4, 8, 16, 32] {
            hidden_mesh(criterion, side);
        }
    });
}

fn format<D: DepthFormat>(criterion: &mut Criterion, name: &str, size: u32) {
    let samples = u64::from(size * size);
    let (near, far) = (D::from_depth(0.0), D::from_depth(1.0));
    // The square has depths below 1; equal ones pass again, so nothing has to be cleared between draws.
    bench(criterion, &format!("pass_{name}"), size, LessOrEqual, [far; 2], samples);
    bench(criterion, &format!("fail_{name}"), size, LessOrEqual, [near; 2], 0);
    bench(criterion, &format!("pass_read_only_{name}"), size, ReadOnly(LessOrEqual), [far; 2], samples);
    // The worst case: runs of one. Read only, or the second draw would meet the first.
    bench(criterion, &format!("every_second_{name}"), size, ReadOnly(Greater), [near, far], samples / 2);
}

fn bench<D: DepthFormat>(
    criterion: &mut Criterion,
    name: &str,
    size: u32,
    test: impl DepthTest,
    columns: [D; 2],
    passing: u64,
) {
    let mut depth: Vec<D> = (0..size * size).map(|i| columns[(i % 2) as usize]).collect();
    let mut target = Surface::depth_only(&mut depth, size, size).expect("of this size");
    let rasterizer =
        Rasterizer::<()>::new(Viewport::of_size(size, size).expect("a small size")).with_depth_test(test);
    let primitives = Primitives::list().indexed(&common::SQUARE_INDICES);
    let mut group = criterion.benchmark_group("depth");
    group.throughput(Throughput::Elements(u64::from(size * size)));

    let mut draw = || rasterizer.draw_depth(&mut target, primitives, common::SQUARE).expect("valid indices");
    assert_eq!(draw().samples_passed, passing, "{name} of {size}");
    group.bench_function(BenchmarkId::new(name, size), |bencher| bencher.iter(&mut draw));

    // The same by a closure that gives no colour.
    let mut draw =
        || rasterizer.draw(&mut target, primitives, &common::SQUARE, (), |_| ()).expect("valid indices");
    assert_eq!(draw().samples_passed, passing, "{name} of {size}, by a closure");
    let name = format!("{name}_by_closure");
    group.bench_function(BenchmarkId::new(name, size), |bencher| bencher.iter(&mut draw));
}

/// A closure behind what is there: with each depth compared, and with coarse depth.
fn hidden(criterion: &mut Criterion, size: u32) {
    let viewport = Viewport::of_size(size, size).expect("a small size");
    let front = Rasterizer::<()>::new(viewport.with_depth_range(0.0, 0.1).expect("in 0..=1"));
    let behind = Rasterizer::<()>::new(viewport);
    let primitives = Primitives::list().indexed(&common::SQUARE_INDICES);
    let mut group = criterion.benchmark_group("depth");
    group.throughput(Throughput::Elements(u64::from(size * size)));
    let (mut color, mut depth) = (vec![0u32; (size * size) as usize], vec![1.0; (size * size) as usize]);
    let mut bounds = vec![1.0; CoarseDepth::bounds_len(Rect::of_size(size, size))];
    let surface = Surface::new(&mut color, &mut depth, size, size).expect("of this size");
    let mut target = CoarseDepth::new(surface, &mut bounds, Less).expect("enough for all");
    front.draw_depth(&mut target, primitives, common::SQUARE).expect("valid indices");

    let mut draw = |name: &str, target: &mut dyn FnMut() -> Statistics| {
        assert_eq!(target().fragments, 0, "{name} of {size}");
        group.bench_function(BenchmarkId::new(name, size), |bencher| bencher.iter(&mut *target));
    };
    let shade = |fragment: Fragment<'_, ()>| fragment.x().unsigned_abs();
    draw("hidden_coarse", &mut || {
        behind.draw(&mut target, primitives, &common::SQUARE, (), shade).expect("valid indices")
    });
    let mut target = Surface::new(&mut color, &mut depth, size, size).expect("of this size");
    draw("hidden", &mut || {
        behind.draw(&mut target, primitives, &common::SQUARE, (), shade).expect("valid indices")
    });
}

/// Compares as [`Less`], and does not say so: no triangle is left out early.
#[derive(Clone, Copy)]
struct Unsaid;

impl DepthTest for Unsaid {
    #[inline(always)]
    fn passes<D: PartialOrd>(self, new: D, old: D) -> bool {
        new < old
    }
}

/// A mesh of squares of `side` pixels behind what is there.
fn hidden_mesh(criterion: &mut Criterion, side: u16) {
    const SIZE: u16 = 512;
    let count = SIZE / side;
    let along = |i: u16| f32::from(i) / f32::from(count) * 2.0 - 1.0;
    let positions: Vec<Vec4> =
        (0..=count).flat_map(|y| (0..=count).map(move |x| Vec4::new(along(x), along(y), 0.5, 1.0))).collect();
    let count = u32::from(count);
    let indices: Vec<u32> = (0..count * count)
        .flat_map(|i| {
            let row = count + 1;
            let corner = i / count * row + i % count;
            [corner, corner + 1, corner + row, corner + row, corner + 1, corner + row + 1]
        })
        .collect();
    let size = u32::from(SIZE);
    let (mut color, mut depth) = (vec![0u32; (size * size) as usize], vec![0.25; (size * size) as usize]);
    let mut target = Surface::new(&mut color, &mut depth, size, size).expect("of this size");
    let says = Rasterizer::<()>::new(Viewport::of_size(size, size).expect("a small size"));
    let does_not = says.with_depth_test(Unsaid);
    let primitives = Primitives::list().indexed(&indices);
    let mut group = criterion.benchmark_group("depth");
    group.throughput(Throughput::Elements(u64::from(count * count * 2)));

    let mut draw = |name: &str, draw: &mut dyn FnMut() -> Statistics| {
        assert_eq!(draw().fragments, 0, "{name} of {side}");
        group.bench_function(BenchmarkId::new(name, side), |bencher| bencher.iter(&mut *draw));
    };
    let shade = |fragment: Fragment<'_, ()>| fragment.x().unsigned_abs();
    draw("hidden_mesh", &mut || {
        says.draw(&mut target, primitives, &positions[..], (), shade).expect("valid indices")
    });
    draw("hidden_mesh_unsaid", &mut || {
        does_not.draw(&mut target, primitives, &positions[..], (), shade).expect("valid indices")
    });
    draw("hidden_mesh_depth", &mut || {
        says.draw_depth(&mut target, primitives, &positions[..]).expect("valid indices")
    });
    draw("hidden_mesh_depth_unsaid", &mut || {
        does_not.draw_depth(&mut target, primitives, &positions[..]).expect("valid indices")
    });
}
