//! Glass and lattice: blending with what is already there, and fragments that are not there at all.
//!
//! 1. Opaque things first, in any order: the depth test sorts them.
//! 2. A cut-out is opaque too. Its closure returns `None` where there is a hole, and no depth is written there.
//! 3. Glass last, from back to front, tested against depth but not writing it (`ReadOnly`). `draw_over` lends the closure
//!    the colour below.

mod support;

use core::error::Error;
use halfplane::glam::{Mat4, Vec2, Vec3, Vec4, vec2, vec3};
use halfplane::{Less, Primitives, Rasterizer, ReadOnly, Surface, Viewport, floor_to_i32, wrap};
use support::{camera::OrbitCamera, image};

const WIDTH: u32 = 960;
const HEIGHT: u32 = 540;
const CORNERS: [Vec2; 4] = [vec2(-1.0, -1.0), vec2(1.0, -1.0), vec2(-1.0, 1.0), vec2(1.0, 1.0)];
const ALPHA: f32 = 0.55;

fn main() -> Result<(), Box<dyn Error>> {
    let camera =
        OrbitCamera { yaw: -24.0, pitch: 20.0, distance: 5.2, radius: 4.8, ..OrbitCamera::default() };
    let world_to_clip = camera.view_projection(WIDTH as f32 / HEIGHT as f32);
    // Every object is the square ±1 in x and y, put somewhere.
    let place = |matrix: Mat4| CORNERS.map(|corner| world_to_clip * matrix * corner.extend(0.0).extend(1.0));

    // Linear light in floats: blending in it is right, and a framebuffer holds whatever one likes.
    let mut light = vec![vec3(0.55, 0.66, 0.80); (WIDTH * HEIGHT) as usize];
    let mut depth = vec![1.0_f32; (WIDTH * HEIGHT) as usize];
    let opaque = Rasterizer::<Vec2>::new(Viewport::of_size(WIDTH, HEIGHT)?);
    let mut target = Surface::new(&mut light, &mut depth, WIDTH, HEIGHT)?;

    let floor = Mat4::from_translation(vec3(0.0, -1.0, 0.0))
        * Mat4::from_rotation_x(-core::f32::consts::FRAC_PI_2)
        * Mat4::from_scale(Vec3::splat(3.0));
    opaque.draw(&mut target, Primitives::strip(), &place(floor), &CORNERS, |fragment| {
        let uv = fragment.varyings() * 6.0;
        let square = (floor_to_i32(uv.x) + floor_to_i32(uv.y)) & 1;
        Vec3::splat(0.25 + 0.45 * square as f32)
    })?;

    let fence = Mat4::from_translation(vec3(0.0, -0.2, -1.6)) * Mat4::from_scale(vec3(2.4, 0.8, 1.0));
    let lattice = opaque.draw(&mut target, Primitives::strip(), &place(fence), &CORNERS, |fragment| {
        let uv = fragment.varyings() * vec2(12.0, 4.0);
        let from_middle = vec2(wrap(uv.x) - 0.5, wrap(uv.y) - 0.5);
        let is_hole = from_middle.length_squared() < 0.4 * 0.4;
        (!is_hole).then_some(vec3(0.36, 0.16, 0.06))
    })?;
    let kept = lattice.samples_passed as f32 / lattice.fragments as f32;
    println!("lattice: {} fragments, {:.0} % kept", lattice.fragments, kept * 100.0);
    // All of it lies before the floor's end, so nothing hides any part, and the rest of a hole's square is 1 − 0.16 π.
    assert!((kept - 0.497).abs() < 0.01, "holes take half of the lattice");

    let (before, depth_before) = (light.clone(), depth.clone());
    let mut target = Surface::new(&mut light, &mut depth, WIDTH, HEIGHT)?;
    let glass = Rasterizer::<()>::new(Viewport::of_size(WIDTH, HEIGHT)?).with_depth_test(ReadOnly(Less));
    let mut panes =
        [(0.0, vec3(0.9, 0.06, 0.05)), (1.0, vec3(0.05, 0.5, 0.08)), (-1.0, vec3(0.04, 0.12, 0.8))].map(
            |(i, tint)| {
                let place = Mat4::from_translation(vec3(i * 0.6 - 0.2, -0.12 * i * i, i * 0.7));
                (place * Mat4::from_scale(vec3(0.7, 1.0 - 0.12 * i * i, 1.0)), tint)
            },
        );
    // Back to front: by the distance, w, of their middles.
    let distance = |matrix: Mat4| (world_to_clip * matrix * Vec4::W).w;
    panes.sort_by(|(a, _), (b, _)| distance(*b).total_cmp(&distance(*a)));
    for (matrix, tint) in panes {
        let drawn = glass.draw_over(&mut target, Primitives::strip(), &place(matrix), (), |_, below| {
            below.lerp(tint, ALPHA)
        })?;
        println!("glass at distance {:.2}: {} pixels", distance(matrix), drawn.samples_passed);
    }
    check(&before, &light, panes.map(|(_, tint)| tint));
    assert!(depth == depth_before, "glass leaves no depth");

    let pixels: Vec<u32> = light.iter().map(|light| image::encode(*light)).collect();
    image::write_png(&image::output_path("transparency"), WIDTH, HEIGHT, &pixels)?;
    Ok(())
}

/// Every pixel is what it was, under some of the panes, in their order.
fn check(before: &[Vec3], after: &[Vec3], tints: [Vec3; 3]) {
    let mut seen = [0; 8];
    for (before, after) in before.iter().zip(after) {
        let through = |set: usize| {
            let panes = (0..3).filter(|pane| set >> pane & 1 == 1);
            panes.fold(*before, |below, pane| below.lerp(tints[pane], ALPHA))
        };
        let set = (0..8).find(|&set| through(set).abs_diff_eq(*after, 1e-6)).expect("in this order");
        seen[set] += 1;
    }
    println!("pixels behind each set of panes: {seen:?}");
    let overlaps = seen[0b011] + seen[0b101] + seen[0b110] + seen[0b111];
    assert!(overlaps > 10_000, "panes are seen through panes");
}
