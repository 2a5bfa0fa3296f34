//! Triangle setup from projected vertices, and what a draw does instead for triangles that nobody sees.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput};
use halfplane::glam::Vec4;
use halfplane::{CullMode, Primitives, ProjectedVertex, Rasterizer, Setup, Surface, Viewport};

const COUNT: usize = 1024;

fn main() {
    common::run(|criterion| {
        for size in [4, 32, 1024] {
            setup(criterion, size);
        }
        let corner = |x: f32, y: f32| Vec4::new(x, y, 0.5, 1.0);
        let pixel = 2.0 / 1024.0;
        // Around no sample: samples are at odd multiples of half a pixel.
        draw(
            criterion,
            "back_face",
            CullMode::Back,
            [corner(0.0, 0.0), corner(0.0, 0.5), corner(0.5, 0.0)],
            1,
        );
        draw(
            criterion,
            "between_samples",
            CullMode::None,
            [corner(pixel * 0.6, 0.0), corner(pixel * 1.4, 0.0), corner(pixel, pixel)],
            0,
        );
        draw(
            criterion,
            "no_area",
            CullMode::None,
            [corner(0.0, 0.0), corner(0.5, 0.5), corner(0.25, 0.25)],
            0,
        );
    });
}

/// `Setup::new` and the edges of random triangles in a square of `size` pixels.
fn setup(criterion: &mut Criterion, size: u16) {
    let mut random = common::Random(1);
    let mut vertex = || {
        // Half pixels, and never the same twice in a triangle's way.
        let mut at = || halfplane::floor_to_i32(random.unit() * f32::from(size) * 256.0);
        ProjectedVertex::new(at(), at(), 0.5, 1.0).expect("inside the guard band")
    };
    let triangles: Vec<_> = (0..COUNT).map(|_| [vertex(), vertex(), vertex()]).collect();
    for triangle in &triangles {
        let [a, b, c] = triangle.map(|vertex| vertex.position_subpixel().expect("inside").map(i64::from));
        let area2 = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        let found = Setup::new(*triangle).map_or(0, |setup| setup.area2());
        assert_eq!(found, area2.abs(), "{triangle:?}");
    }
    criterion.benchmark_group("setup").throughput(Throughput::Elements(COUNT as u64)).bench_function(
        BenchmarkId::new("random_triangle", size),
        |bencher| {
            bencher.iter(|| {
                let mut sum = 0;
                for setup in triangles.iter().filter_map(|&triangle| Setup::new(triangle)) {
                    sum += setup.edges().iter().map(|edge| edge.step_x()).sum::<i64>() ^ setup.area2();
                }
                sum
            });
        },
    );
}

/// A draw of triangles that show nothing.
fn draw(criterion: &mut Criterion, name: &str, cull_mode: CullMode, triangle: [Vec4; 3], culled: u64) {
    let positions: Vec<Vec4> = core::iter::repeat_n(triangle, COUNT).flatten().collect();
    let mut rasterizer = Rasterizer::<()>::new(Viewport::of_size(1024, 1024).expect("a small size"));
    rasterizer.cull_mode = cull_mode;
    let mut pixels = vec![0u32; 1024 * 1024];
    let mut target = Surface::color_only(&mut pixels, 1024, 1024).expect("of this size");
    let mut room = vec![ProjectedVertex::default(); positions.len()];
    let vertices = rasterizer.project(positions.as_slice(), &mut room).expect("room enough");
    let mut draw = || {
        rasterizer
            .draw(&mut target, Primitives::list(), vertices, (), |_| u32::MAX)
            .expect("they have an end")
    };
    let found = draw();
    assert_eq!((found.culled, found.fragments), (culled * COUNT as u64, 0), "{name}");
    criterion
        .benchmark_group("setup")
        .throughput(Throughput::Elements(COUNT as u64))
        .bench_function(BenchmarkId::new(name, COUNT), |bencher| bencher.iter(&mut draw));
}
