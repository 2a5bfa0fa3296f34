//! One program for every processor: the same draw call, compiled for several, of which each machine runs the best it can.
//!
//! The whole draw is inlined into the function that calls it. So it is compiled for the processor that this function is
//! compiled for, and a crate like `multiversion` around it makes AVX2 and AVX-512 of the draw, without `unsafe` here.
//! The closure comes along, because it is written in a function that is inlined too, and has the attribute itself: it is
//! called in several functions now, and a large one would be left outside of all of them.
//!
//! The feature `dispatch` tells `halfplane` that draws have wider registers than the crate is compiled for:
//! `cargo run --release --features dispatch --example dispatch`. Here that hardly shows; a mesh whose triangles have some
//! nine pixels takes a seventh less time with it.

use std::time::Instant;

use halfplane::glam::{Vec2, Vec4, vec3};
use halfplane::{Primitives, Rasterizer, Surface, Viewport, floor_to_i32, pack_rgba8};
use multiversion::multiversion;

const WIDTH: u32 = 1920;
const HEIGHT: u32 = 1080;

/// A frame: eight layers over the whole screen, each nearer than the one before.
struct Frame {
    pixels: Vec<u32>,
    depth: Vec<f32>,
}

/// For any processor of the architecture, or whatever `-C target-cpu` says.
fn draw(frame: &mut Frame) {
    draw_inlined(frame);
}

/// For the best of these that the machine has. It is found out once, then a call costs one jump.
#[multiversion(targets(
    "x86_64+avx512f+avx512bw+avx512dq+avx512vl+avx2+bmi1+bmi2+fma+lzcnt+popcnt",
    "x86_64+avx2+bmi1+bmi2+fma+lzcnt+popcnt",
    "aarch64+neon"
))]
fn draw_dispatched(frame: &mut Frame) {
    draw_inlined(frame);
}

#[inline(always)]
fn draw_inlined(frame: &mut Frame) {
    let mut target = Surface::new(&mut frame.pixels, &mut frame.depth, WIDTH, HEIGHT).expect("of this size");
    let rasterizer = Rasterizer::new(Viewport::of_size(WIDTH, HEIGHT).expect("a small size"));
    let quad = Primitives::list().indexed(&[0u8, 1, 2, 2, 1, 3]);
    for layer in 0..8 {
        let z = 0.9 - 0.1 * layer as f32;
        let corner = |x: f32, y: f32, w: f32| Vec4::new(x * w, y * w, z * w, w);
        let positions =
            [corner(-1.0, -1.0, 1.0), corner(1.0, -1.0, 3.0), corner(-1.0, 1.0, 3.0), corner(1.0, 1.0, 9.0)];
        let uvs = [Vec2::ZERO, Vec2::X, Vec2::Y, Vec2::ONE].map(|uv| uv * 8.0 + layer as f32 * 0.3);
        let drawn = rasterizer.draw(
            &mut target,
            quad,
            &positions,
            &uvs,
            #[inline(always)]
            |fragment| {
                let uv = fragment.varyings();
                let is_light = (floor_to_i32(uv.x) ^ floor_to_i32(uv.y)) & 1 == 0;
                // `Vec3` and not `Vec4`, which is a SIMD register already and cannot be a lane of a wider one.
                let color = if is_light { vec3(0.94, 0.86, 0.72) } else { vec3(0.16, 0.29, 0.48) };
                pack_rgba8((color * fragment.inv_w()).extend(1.0))
            },
        );
        let samples = drawn.expect("valid indices").samples_passed;
        assert_eq!(samples, u64::from(WIDTH * HEIGHT), "every layer is nearer");
    }
}

fn main() {
    let new = || {
        let pixels = (WIDTH * HEIGHT) as usize;
        Frame { pixels: vec![0; pixels], depth: vec![1.0; pixels] }
    };
    let (mut plain, mut dispatched) = (new(), new());
    let [mut plain_time, mut dispatched_time] = [f64::INFINITY; 2];
    for _ in 0..10 {
        plain_time = plain_time.min(time(&mut plain, draw));
        dispatched_time = dispatched_time.min(time(&mut dispatched, draw_dispatched));
    }

    assert_eq!(plain.pixels, dispatched.pixels, "the same colours");
    let bits = |depth: &[f32]| depth.iter().map(|depth| depth.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(&plain.depth), bits(&dispatched.depth), "the same depths, to the bit");
    println!("the same {} pixels and depths by either", plain.pixels.len());
    println!(
        "{plain_time:.1} ms as compiled, {dispatched_time:.1} ms dispatched: {:.2} times as fast",
        plain_time / dispatched_time
    );
}

/// Milliseconds for a frame.
fn time(frame: &mut Frame, draw: impl Fn(&mut Frame)) -> f64 {
    frame.depth.fill(1.0);
    let start = Instant::now();
    draw(frame);
    start.elapsed().as_secs_f64() * 1e3
}
