//! A visibility buffer: draw *which triangle and where in it*, and shade later, each pixel once.
//!
//! A pixel is any `Copy` type, so here it is a triangle's number and two of its perspective weights. A second loop, which
//! knows nothing of rasterization, fetches the vertices and shades. From left to right: triangle numbers, weights, the
//! shaded picture.

mod support;

use core::error::Error;
use halfplane::glam::{Vec3, vec3};
use halfplane::{Computed, Primitives, Rasterizer, Surface, Viewport};
use support::{camera::OrbitCamera, image, mesh::Mesh, shade::unit, teapot};

const SIDE: u32 = 480;

/// What a pixel shows.
#[derive(Clone, Copy)]
struct Visible {
    triangle: u32,
    weights: [f32; 2],
}

const NOTHING: Visible = Visible { triangle: u32::MAX, weights: [0.0; 2] };

fn main() -> Result<(), Box<dyn Error>> {
    let mut mesh = teapot::tessellate(6, |_, _| ());
    mesh.fit_unit_sphere();
    let camera = OrbitCamera { fov: 35.0, distance: 3.6, ..OrbitCamera::default() };
    let matrix = camera.view_projection(1.0);
    let positions = Computed::new(mesh.positions.len(), |i| matrix * mesh.positions[i].extend(1.0));
    let primitives = Primitives::list().indexed(&mesh.indices);
    let viewport = Viewport::of_size(SIDE, SIDE)?;

    let mut visible = vec![NOTHING; (SIDE * SIDE) as usize];
    let mut depth = vec![1.0_f32; (SIDE * SIDE) as usize];
    let mut target = Surface::new(&mut visible, &mut depth, SIDE, SIDE)?;
    let drawn = Rasterizer::<()>::new(viewport).draw(&mut target, primitives, positions, (), |fragment| {
        let [a, b, _] = fragment.weights();
        Visible { triangle: fragment.primitive_index(), weights: [a, b] }
    })?;

    let mut pixels = vec![0; (3 * SIDE * SIDE) as usize];
    let mut shaded = 0;
    for (row, visible) in pixels.chunks_mut(3 * SIDE as usize).zip(visible.chunks(SIDE as usize)) {
        for (x, visible) in visible.iter().enumerate() {
            let paper = vec3(0.03, 0.035, 0.05);
            let colors = if visible.triangle == NOTHING.triangle {
                [paper; 3]
            } else {
                shaded += 1;
                let [a, b] = visible.weights;
                [hue(visible.triangle), vec3(a, b, 1.0 - a - b), shade(interpolated_normal(&mesh, *visible))]
            };
            for (panel, color) in colors.into_iter().enumerate() {
                row[panel * SIDE as usize + x] = image::encode(color);
            }
        }
    }
    println!("{} fragments drawn, {shaded} pixels shaded", drawn.fragments);
    assert!(shaded < drawn.fragments, "what was hidden later is not shaded");

    // Interpolating while drawing gives the same picture.
    let mut forward = vec![image::encode(vec3(0.03, 0.035, 0.05)); (SIDE * SIDE) as usize];
    depth.fill(1.0);
    let mut target = Surface::new(&mut forward, &mut depth, SIDE, SIDE)?;
    let normals = &mesh.normals[..];
    Rasterizer::<Vec3>::new(viewport).draw(&mut target, primitives, positions, normals, |fragment| {
        image::encode(shade(fragment.varyings()))
    })?;
    for (row, forward) in pixels.chunks(3 * SIDE as usize).zip(forward.chunks(SIDE as usize)) {
        for (later, at_once) in row[2 * SIDE as usize..].iter().zip(forward) {
            for (a, b) in later.to_le_bytes().into_iter().zip(at_once.to_le_bytes()) {
                assert!(a.abs_diff(b) <= 1, "{later:x} {at_once:x}");
            }
        }
    }
    image::write_png(&image::output_path("visibility_buffer"), 3 * SIDE, SIDE, &pixels)?;
    Ok(())
}

fn interpolated_normal(mesh: &Mesh, Visible { triangle, weights: [a, b] }: Visible) -> Vec3 {
    let corners = &mesh.indices[3 * triangle as usize..][..3];
    let [p, q, r] = [0, 1, 2].map(|i| mesh.normals[corners[i] as usize]);
    p * a + q * b + r * (1.0 - a - b)
}

fn shade(normal: Vec3) -> Vec3 {
    let normal = unit(normal);
    let sun = normal.dot(unit(vec3(-0.3, 0.8, 0.6))).max(0.0);
    vec3(0.10, 0.13, 0.18) * (1.0 + normal.y) + vec3(0.75, 0.42, 0.22) * sun
}

/// Neighbouring numbers, colours far apart.
fn hue(number: u32) -> Vec3 {
    let mixed = (number ^ number >> 3).wrapping_mul(2_654_435_769);
    let turn = mixed as f32 / u32::MAX as f32;
    let wave = |offset: f32| 0.45 + 0.4 * ((turn + offset) * core::f32::consts::TAU).sin();
    vec3(wave(0.0), wave(1.0 / 3.0), wave(2.0 / 3.0))
}
