//! Vertices on their way to the subpixel grid: `Rasterizer::project`, with and without a matrix before it.

mod common;

use criterion::{BenchmarkId, Criterion, Throughput};
use halfplane::glam::camera::rh::proj::directx::perspective;
use halfplane::glam::{Mat4, Vec3, Vec4};
use halfplane::{Attributes, Computed, Projected, ProjectedVertex, Rasterizer, Viewport};

const WIDTH: u32 = 1920;
const HEIGHT: u32 = 1080;

fn main() {
    common::run(|criterion| {
        for count in [4, 64, 1024, 131_072] {
            let matrix = perspective(1.0, WIDTH as f32 / HEIGHT as f32, 0.5, 32.0)
                * Mat4::from_translation(Vec3::NEG_Z * 4.0);
            let mut random = common::Random(1);
            let model: Vec<Vec3> = (0..count)
                .map(|_| Vec3::new(random.unit(), random.unit(), random.unit()) * 2.0 - Vec3::ONE)
                .collect();
            let clip: Vec<Vec4> = model.iter().map(|p| matrix * p.extend(1.0)).collect();
            bench(
                criterion,
                "matrix_and_perspective",
                Computed::new(count, |i| matrix * model[i].extend(1.0)),
                &clip,
            );
            bench(criterion, "perspective", clip.as_slice(), &clip);
            // Behind the near plane: each is classified.
            let outside: Vec<Vec4> = clip.iter().map(|p| p.with_z(-1.0)).collect();
            bench(criterion, "outside", outside.as_slice(), &outside);
        }
    });
}

fn bench<A: Attributes<Value = Vec4> + Copy>(
    criterion: &mut Criterion,
    name: &str,
    positions: A,
    clip: &[Vec4],
) {
    let rasterizer = Rasterizer::<()>::new(Viewport::of_size(WIDTH, HEIGHT).expect("a small size"));
    let mut room = vec![ProjectedVertex::default(); clip.len()];
    check(&rasterizer.project(positions, &mut room).expect("room enough"), clip);
    criterion.benchmark_group("project").throughput(Throughput::Elements(clip.len() as u64)).bench_function(
        BenchmarkId::new(name, clip.len()),
        |bencher| {
            bencher.iter(|| {
                let projected = rasterizer.project(positions, &mut room).expect("room enough");
                projected.vertices().last().copied()
            });
        },
    );
}

/// Compares with the viewport's formula in `f64`.
fn check<A: Attributes<Value = Vec4>>(projected: &Projected<'_, A>, clip: &[Vec4]) {
    for (vertex, p) in projected.vertices().iter().zip(clip) {
        let [x, y, w] = [p.x, p.y, p.w].map(f64::from);
        let exact =
            [(x / w + 1.0) * 0.5 * f64::from(WIDTH) * 256.0, (1.0 - y / w) * 0.5 * f64::from(HEIGHT) * 256.0];
        let is_near = |place: [i32; 2]| (0..2).all(|i| (f64::from(place[i]) - exact[i]).abs() < 0.75);
        let is_right = if p.z < 0.0 {
            vertex.position_subpixel().is_none()
        } else {
            vertex.position_subpixel().is_some_and(is_near)
        };
        assert!(is_right, "{p:?} became {vertex:?}, not {exact:?}");
    }
}
