//! Why interpolation has to divide by w: one triangle in perspective, four ways to look at it.
//!
//! ```text
//!   naive            perspective-correct     depth                 checkerboard, perspective-correct
//!   linear on the    c = z (α' c_a / z_a     1/z is linear on      10 × 10 squares between (0, 0), (1, 0)
//!   screen           + β' c_b / z_b + …)     the screen            and (0, 1) at v2, v1 and v0
//! ```
//!
//! A camera at the origin looks along +z with y up, and projects to x / z and y / z. In clip space that is w = z. At every
//! pixel the result is compared with the formula, in double precision.

mod support;

use core::error::Error;
use halfplane::glam::{Vec2, Vec3, vec2, vec3, vec4};
use halfplane::{
    Fragment, NoPerspective, Primitives, Rasterizer, Surface, Viewport, floor_to_i32, pack_rgba8,
};
use support::image;

const SIDE: u32 = 512;
const PANELS: u32 = 4;
const PAPER: u32 = 0xffba_a594;
/// The depths of the near and the far plane.
const NEAR: f32 = 40.0;
const FAR: f32 = 120.0;

/// v2, v1 and v0 in camera space: in this order they turn counter-clockwise.
const VERTICES: [Vec3; 3] = [vec3(-48.0, -10.0, 82.0), vec3(29.0, -15.0, 44.0), vec3(13.0, 34.0, 114.0)];
const COLORS: [Vec3; 3] = [Vec3::X, Vec3::Y, Vec3::Z];
const UVS: [Vec2; 3] = [vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(0.0, 1.0)];

#[derive(Clone, Copy)]
struct Corner {
    naive: NoPerspective<Vec3>,
    color: Vec3,
    uv: Vec2,
}

halfplane::varyings!(Corner { naive, color, uv });

fn checker(uv: Vec2) -> Vec3 {
    let square = floor_to_i32(uv.x * 10.0) + floor_to_i32(uv.y * 10.0);
    Vec3::splat(0.05 + 0.9 * (square & 1) as f32)
}

fn main() -> Result<(), Box<dyn Error>> {
    let width = SIDE * PANELS;
    let mut pixels = vec![PAPER; (width * SIDE) as usize];
    let mut target = Surface::color_only(&mut pixels, width, SIDE)?;

    // z_clip / w runs from 0 at the near plane to 1 at the far one.
    let positions = VERTICES.map(|v| vec4(v.x, v.y, FAR * (v.z - NEAR) / (FAR - NEAR), v.z));
    let corners = [0, 1, 2].map(|i| Corner { naive: NoPerspective(COLORS[i]), color: COLORS[i], uv: UVS[i] });

    let panels: [fn(Fragment<'_, Corner>) -> Vec3; PANELS as usize] = [
        |fragment| fragment.varyings().naive.0,
        |fragment| fragment.varyings().color,
        |fragment| Vec3::splat(1.0 - fragment.depth()),
        |fragment| checker(fragment.varyings().uv),
    ];
    for (x, shade) in (0..width).step_by(SIDE as usize).zip(panels) {
        let viewport = Viewport::new(x as f32, 0.0, SIDE as f32, SIDE as f32)?;
        let drawn = Rasterizer::new(viewport).draw(
            &mut target,
            Primitives::list(),
            &positions,
            &corners,
            |fragment| pack_rgba8(shade(fragment).extend(1.0)),
        )?;
        println!("panel at column {x}: {} pixels", drawn.samples_passed);
    }

    let compared = (0..width * SIDE).filter(|&i| is_as_expected(i % width, i / width, pixels[i as usize]));
    println!("{} of {} pixels equal the formula", compared.count(), width * SIDE);
    image::write_png(&image::output_path("perspective"), width, SIDE, &pixels)?;
    Ok(())
}

/// Compares a pixel with the formula; false where rounding may decide, on an edge of the triangle or of a square.
fn is_as_expected(x: u32, y: u32, pixel: u32) -> bool {
    // Raster coordinates are (1 + x / z) / 2 · SIDE, and rows count from the bottom.
    let raster = |x: f32, z: f32| (1.0 + f64::from(x) / f64::from(z)) * 0.5 * f64::from(SIDE);
    let [a, b, c] = VERTICES.map(|v| [raster(v.x, v.z), raster(v.y, v.z)]);
    let sample = [f64::from(x % SIDE) + 0.5, f64::from(SIDE - y) - 0.5];
    let area =
        |p: [f64; 2], q: [f64; 2], r: [f64; 2]| (q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]);
    let linear =
        [area(b, c, sample), area(c, a, sample), area(a, b, sample)].map(|part| part / area(a, b, c));
    let least = linear.into_iter().fold(1.0, f64::min);
    if least < 0.002 {
        assert!(least > -0.002 || pixel == PAPER, "outside: {x} {y}");
        return least <= -0.002;
    }
    let parts = [0, 1, 2].map(|i| linear[i] / f64::from(VERTICES[i].z));
    let z = 1.0 / parts.iter().sum::<f64>();
    let weights = parts.map(|part| part * z);

    let expected = match x / SIDE {
        0 => linear,
        1 => weights,
        2 => {
            let (near, far) = (f64::from(NEAR), f64::from(FAR));
            [1.0 - far * (z - near) / ((far - near) * z); 3]
        }
        _ => {
            let [s, t] = [weights[1] * 10.0, weights[2] * 10.0];
            if (s - s.round()).abs() < 0.01 || (t - t.round()).abs() < 0.01 {
                return false;
            }
            [0.05 + 0.9 * ((s.floor() + t.floor()) % 2.0); 3]
        }
    };
    for (channel, expected) in pixel.to_le_bytes().into_iter().zip(expected) {
        let difference = f64::from(channel) - expected * 255.0;
        assert!(difference.abs() < 1.0, "{difference} / 255 at {x} {y}");
    }
    true
}
