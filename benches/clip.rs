//! Clipping: draws whose triangles lie outside, inside, or are cut, into a scissor of one pixel that makes the rest cheap.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput};
use halfplane::glam::{Vec3, Vec4};
use halfplane::{Primitives, Rasterizer, Rect, Surface, Viewport};

const COUNT: usize = 1024;

/// What happens to all triangles.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    Inside,
    Cut,
    Outside,
}

fn main() {
    // Clip space: w is the distance from the eye, the near plane at 1. Three corners at these distances:
    let triangle = |size: f32, [a, b, c]: [f32; 3]| {
        let corner = |x: f32, y: f32, w: f32| Vec4::new(x * size, y * size, w - 1.0, w);
        [corner(-1.0, -1.0, a), corner(1.0, -1.0, b), corner(0.0, 1.0, c)]
    };
    common::run(|criterion| {
        bench(criterion, "inside", triangle(3.0, [4.0, 4.0, 4.0]), Fate::Inside);
        bench(criterion, "one_corner_before_near", triangle(3.0, [4.0, 4.0, 0.5]), Fate::Cut);
        bench(criterion, "two_corners_before_near", triangle(3.0, [0.5, 0.5, 4.0]), Fate::Cut);
        bench(criterion, "larger_than_guard_band", triangle(9e5, [4.0, 4.0, 4.0]), Fate::Cut);
        bench(criterion, "all_before_near", triangle(3.0, [0.5, 0.5, 0.5]), Fate::Outside);
    });
}

/// Draws many of almost the same triangle.
fn bench(criterion: &mut Criterion, name: &str, triangle: [Vec4; 3], fate: Fate) {
    let mut random = common::Random(1);
    let mut positions = Vec::new();
    for _ in 0..COUNT {
        let shake = Vec3::new(random.unit(), random.unit(), 0.0) * 0.01;
        positions.extend(triangle.map(|p| p + shake.extend(0.0)));
    }
    let mut rasterizer = Rasterizer::<()>::new(Viewport::of_size(1920, 1080).expect("a small size"));
    rasterizer.scissor = Some(Rect { x: 960, y: 540, width: 1, height: 1 });
    let mut pixels = vec![0u32; 1920 * 1080];
    let mut target = Surface::color_only(&mut pixels, 1920, 1080).expect("of this size");
    let mut draw = || {
        rasterizer
            .draw(&mut target, Primitives::list(), positions.as_slice(), (), |_| u32::MAX)
            .expect("positions have an end")
    };
    let found = draw();
    let all_if = |is_that: bool| if is_that { COUNT as u64 } else { 0 };
    assert_eq!(found.clipped, all_if(fate == Fate::Cut), "{name}");
    assert_eq!(found.outside, all_if(fate == Fate::Outside), "{name}");
    assert_eq!(found.samples_passed, all_if(fate != Fate::Outside), "{name}: the pixel in the middle");
    criterion
        .benchmark_group("clip")
        .throughput(Throughput::Elements(COUNT as u64))
        .bench_function(BenchmarkId::new(name, COUNT), |bencher| bencher.iter(&mut draw));
}
