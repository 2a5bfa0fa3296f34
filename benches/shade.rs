//! What varyings and closures cost: a square in perspective, colour only, so that nothing else counts.

mod common;
#[path = "workloads/mod.rs"]
mod workloads;

use criterion::{BenchmarkId, Criterion, Throughput};
use halfplane::glam::{Vec2, Vec3, Vec4};
use halfplane::{
    Flat, Fragment, NoPerspective, Primitives, Rasterizer, Surface, Varyings, Viewport, floor_to_i32,
    linear_to_srgb8, pack_rgba8, pack_srgba8,
};

use workloads::{Place, Texture, lit_place, lit_texture};

#[derive(Clone, Copy)]
struct Lit {
    normal: Vec3,
    uv: Vec2,
    material: Flat<u32>,
}

halfplane::varyings!(Lit { normal, uv, material });

/// Texture coordinates: 0 to 1 along both sides.
const UVS: [Vec2; 4] = [Vec2::new(0.0, 1.0), Vec2::ONE, Vec2::ZERO, Vec2::new(1.0, 0.0)];

fn main() {
    common::run(|criterion| {
        for size in [4, 16, 64, 256, 1024] {
            bench(criterion, "vec2", size, UVS, |f| pack_rgba8(f.varyings().extend(0.0).extend(1.0)), u_at);
        }
        let size = 512;
        bench(criterion, "nothing", size, [(); 4], |_| 0xff_8080, |_| 128.0);
        bench(criterion, "flat", size, [Flat(0x80); 4], |f| f.varyings().0, |_| 128.0);
        bench(criterion, "f32", size, UVS.map(|uv| uv.x), |f| gray(f.varyings()), u_at);
        let screen = |f: Fragment<'_, NoPerspective<f32>>| gray(f.varyings().0);
        bench(criterion, "no_perspective", size, UVS.map(|uv| NoPerspective(uv.x)), screen, |x| x * 255.0);
        let color = UVS.map(|uv| uv.extend(0.0).extend(1.0));
        bench(criterion, "vec4", size, color, |f| pack_rgba8(f.varyings()), u_at);
        // `Vec4` is a SIMD register already where there is SIMD: four floats can be lanes of a wider one.
        let array = color.map(|color| color.to_array());
        bench(criterion, "array_of_4", size, array, |f| pack_rgba8(Vec4::from_array(f.varyings())), u_at);
        let lit = UVS.map(|uv| Lit { normal: Vec3::Z, uv, material: Flat(0xff00_0000) });
        let shade = |f: Fragment<'_, Lit>| {
            let Lit { normal, uv, material } = f.varyings();
            gray(uv.x * normal.z / normal.length_squared().sqrt()) | material.0
        };
        bench(criterion, "struct", size, lit, shade, u_at);
        let derivative = |f: Fragment<'_, Vec2>| gray(f.varyings_dx().x * 512.0 * 0.25);
        // u = x / (4 − 3x), of which this is the derivative.
        bench(criterion, "derivative", size, UVS, derivative, |x| 255.0 / (4.0 - 3.0 * x).powi(2));
        let discard = |f: Fragment<'_, Vec2>| {
            let uv = f.varyings();
            (uv.x < 2.0).then_some(gray(uv.x))
        };
        bench(criterion, "discard", size, UVS, discard, u_at);
        // What not to write: `as` saturates, and a branch.
        #[expect(clippy::cast_possible_truncation, reason = "to see what it costs")]
        let cast = |f: Fragment<'_, Vec2>| (f.varyings().x * 255.0 + 0.5) as u32;
        bench(criterion, "vec2_by_as", size, UVS, cast, u_at);
        let floor = |f: Fragment<'_, Vec2>| floor_to_i32(f.varyings().x * 255.0 + 0.5) as u32;
        bench(criterion, "vec2_by_floor_to_i32", size, UVS, floor, u_at);
        // To sRGB, by powers, and by a table, which keeps the loop from becoming SIMD.
        let srgb_at = |x: f32| match u_at(x) / 255.0 {
            u if u <= 0.003_130_8 => 255.0 * 12.92 * u,
            u => 255.0 * (1.055 * u.powf(1.0 / 2.4) - 0.055),
        };
        let by_power = |f: Fragment<'_, Vec2>| pack_srgba8(f.varyings().extend(0.0).extend(1.0));
        bench(criterion, "vec2_by_pack_srgba8", size, UVS, by_power, srgb_at);
        let by_table = |f: Fragment<'_, Vec2>| {
            let uv = f.varyings();
            u32::from_le_bytes([linear_to_srgb8(uv.x), linear_to_srgb8(uv.y), 0, 255])
        };
        bench(criterion, "vec2_by_linear_to_srgb8", size, UVS, by_table, srgb_at);
        // A texture of many levels, in one closure, and in two stages.
        bench_texture(criterion, 512);
        // A number that a closure holds, or borrows: with AVX, fragments that are left over after SIMD make the difference.
        let scale = core::hint::black_box(1.0);
        bench_tiny(criterion, "tiny_by_move", size, move |f| gray(f.varyings() * scale));
        bench_tiny(criterion, "tiny_by_reference", size, |f| gray(f.varyings() * scale));
    });
}

/// Which texels a fragment shows, and how much light. (Inlined into two draws.)
#[inline(always)]
fn place(f: Fragment<'_, Lit>) -> (f32, Place) {
    let Lit { normal, uv, .. } = f.varyings();
    lit_place(workloads::Lit { normal, uv }, f.varyings_dx().uv, f.varyings_dy().uv)
}

/// A closure that fetches: four texels of the level that derivatives say, in which most steps wait for the one before.
fn bench_texture(criterion: &mut Criterion, size: u32) {
    let texture = Texture::waves();
    let rasterizer = Rasterizer::<Lit>::new(Viewport::of_size(size, size).expect("a small size"));
    let primitives = Primitives::list().indexed(&common::SQUARE_INDICES);
    let values = UVS.map(|uv| Lit { normal: Vec3::Z, uv, material: Flat(0) });
    let staged = rasterizer.staged(place);
    let one_stage = |pixels: &mut [u32]| {
        let mut target = Surface::color_only(pixels, size, size).expect("of this size");
        rasterizer
            .draw(&mut target, primitives, &common::SQUARE, &values, |f| lit_texture(&texture, place(f)))
            .expect("valid")
    };
    let two_stages = |pixels: &mut [u32]| {
        let mut target = Surface::color_only(pixels, size, size).expect("of this size");
        staged
            .draw(&mut target, primitives, &common::SQUARE, &values, |place| lit_texture(&texture, place))
            .expect("valid")
    };
    let (mut one, mut two) = (vec![0u32; (size * size) as usize], vec![0u32; (size * size) as usize]);
    assert_eq!(one_stage(&mut one), two_stages(&mut two), "as many fragments");
    assert!(one == two && one.iter().any(|&pixel| pixel != one[0]), "the same picture, and one");
    let mut group = criterion.benchmark_group("shade");
    group.throughput(Throughput::Elements(u64::from(size * size)));
    group.bench_function(BenchmarkId::new("texture", size), |bencher| bencher.iter(|| one_stage(&mut one)));
    group.bench_function(BenchmarkId::new("texture_staged", size), |bencher| {
        bencher.iter(|| two_stages(&mut two));
    });
}

/// Triangles of six to ten pixels each, over a square.
fn bench_tiny(
    criterion: &mut Criterion,
    name: &str,
    size: u32,
    mut shade: impl FnMut(Fragment<'_, f32>) -> u32,
) {
    let cells = size / 4;
    let corner = |x: u32, y: u32| Vec2::new(x as f32, y as f32) * (2.0 / cells as f32) - 1.0;
    let positions: Vec<Vec4> = (0..cells * cells)
        .map(|cell| (cell % cells, cell / cells))
        .flat_map(|(x, y)| [(x, y), (x + 1, y), (x, y + 1), (x, y + 1), (x + 1, y), (x + 1, y + 1)])
        .map(|(x, y)| corner(x, y).extend(0.5).extend(1.0))
        .collect();
    let us: Vec<f32> = positions.iter().map(|position| position.x * 0.5 + 0.5).collect();
    let rasterizer = Rasterizer::new(Viewport::of_size(size, size).expect("a small size"));
    let mut pixels = vec![0u32; (size * size) as usize];
    let mut draw = |pixels: &mut [u32]| {
        let mut target = Surface::color_only(pixels, size, size).expect("of this size");
        rasterizer.draw(&mut target, Primitives::list(), &positions[..], &us[..], &mut shade).expect("valid")
    };
    assert_eq!(draw(&mut pixels).samples_passed, u64::from(size * size), "{name} of {size}");
    for (i, pixel) in (0..).zip(&pixels) {
        let expected = 255.0 * ((i % size) as f32 + 0.5) / size as f32;
        assert!(((pixel & 0xff) as f32 - expected).abs() < 0.52, "{name} of {size} at {i}");
    }
    criterion
        .benchmark_group("shade")
        .throughput(Throughput::Elements(positions.len() as u64 / 3))
        .bench_function(BenchmarkId::new(name, size), |bencher| bencher.iter(|| draw(&mut pixels)));
}

fn gray(x: f32) -> u32 {
    pack_rgba8(Vec4::new(x, x, x, 1.0))
}

/// The red channel of u at x in 0 ..= 1 of the screen: w goes from 1 to 4, and u/w is linear.
fn u_at(x: f32) -> f32 {
    255.0 * x / (4.0 - 3.0 * x)
}

fn bench<V: Varyings, R: Into<Option<u32>>>(
    criterion: &mut Criterion,
    name: &str,
    size: u32,
    varyings: [V; 4],
    shade: impl Fn(Fragment<'_, V>) -> R + Copy,
    red_at: impl Fn(f32) -> f32,
) {
    let mut pixels = vec![0u32; (size * size) as usize];
    let rasterizer = Rasterizer::new(Viewport::of_size(size, size).expect("a small size"));
    let primitives = Primitives::list().indexed(&common::SQUARE_INDICES);
    let draw = |pixels: &mut [u32]| {
        let mut target = Surface::color_only(pixels, size, size).expect("of this size");
        rasterizer.draw(&mut target, primitives, &common::SQUARE, &varyings, shade).expect("valid indices")
    };
    assert_eq!(draw(&mut pixels).samples_passed, u64::from(size * size), "{name} of {size}");
    for (i, pixel) in (0..).zip(&pixels) {
        let x = ((i % size) as f32 + 0.5) / size as f32;
        let (found, expected) = ((pixel & 0xff) as f32, red_at(x));
        assert!((found - expected).abs() < 0.52, "{name} of {size} at {i}: {found}, not {expected}");
    }
    criterion
        .benchmark_group("shade")
        .throughput(Throughput::Elements(u64::from(size * size)))
        .bench_function(BenchmarkId::new(name, size), |bencher| bencher.iter(|| draw(&mut pixels)));
}
