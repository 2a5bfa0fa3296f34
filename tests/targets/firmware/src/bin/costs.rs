//! Measures a draw: stack, instructions per pixel of a large triangle, and per triangle of about four pixels.
//!
//! Prints lines of `name value`, and fails when a draw did not draw what it should.
#![no_std]
#![no_main]

use core::hint::black_box;

use halfplane::glam::{Vec3, Vec4};
use halfplane::{ProjectedVertex, Statistics};
use halfplane_firmware::{Frame, board, draw, draw_projected, rasterizer};
use semihosting::{println, process};

/// Quads along each axis of the mesh of small triangles. Each is 4 × 2 pixels of the frame, two triangles of 4 pixels.
const QUADS: [u16; 2] = [12, 24];
const VERTICES: usize = (QUADS[0] as usize + 1) * (QUADS[1] as usize + 1);
const TRIANGLES: usize = 2 * QUADS[0] as usize * QUADS[1] as usize;

struct Mesh {
    positions: [Vec4; VERTICES],
    colors: [Vec3; VERTICES],
    indices: [[u16; 3]; TRIANGLES],
}

static mut FRAME: Frame = Frame::new();
static mut MESH: Mesh =
    Mesh { positions: [Vec4::ZERO; VERTICES], colors: [Vec3::ZERO; VERTICES], indices: [[0; 3]; TRIANGLES] };

#[board::entry]
fn main() -> ! {
    // SAFETY: the only references, in a function that runs once.
    let (frame, mesh) = unsafe { (&mut *(&raw mut FRAME), &mut *(&raw mut MESH)) };
    match measure(frame, mesh) {
        Some(()) => process::exit(0),
        None => {
            println!("a draw did not draw what it should");
            process::exit(1)
        }
    }
}

fn measure(frame: &mut Frame, mesh: &mut Mesh) -> Option<()> {
    let colors = [Vec3::X, Vec3::Y, Vec3::Z];
    let one: &[u16] = &[0, 1, 2];

    // Through the near plane, with a part in front of it.
    let clipped =
        [Vec4::new(-1.0, -1.0, -0.5, 0.5), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 2.0, 1.5, 2.0)];
    let (bytes, statistics) = board::stack(|| draw(frame, black_box(&clipped), &colors, one));
    println!("stack {bytes}");
    check(statistics?.clipped == 1 && statistics?.samples_passed > 1000)?;

    // Half of the frame.
    frame.clear();
    let large =
        [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(2.0, -2.0, 1.0, 2.0), Vec4::new(-3.0, 3.0, 1.0, 3.0)];
    let (instructions, statistics) = board::instructions(|| draw(frame, black_box(&large), &colors, one));
    let pixels = statistics?.samples_passed;
    check(pixels > 8000)?;
    println!("large/instructions {instructions}");
    println!("large/pixels {pixels}");

    // The same again, behind itself: every fragment fails the depth test.
    let (instructions, statistics) = board::instructions(|| draw(frame, black_box(&large), &colors, one));
    check(statistics?.samples_passed == 0)?;
    println!("hidden/instructions {instructions}");

    // Many small ones.
    frame.clear();
    mesh.fill();
    let mut room = [ProjectedVertex::default(); VERTICES];
    let (instructions, vertices) =
        board::instructions(|| rasterizer()?.project(&mesh.positions[..], &mut room).ok());
    println!("project/instructions {instructions}");
    println!("project/vertices {VERTICES}");
    let (vertices, indices) = (vertices?, mesh.indices.as_flattened());
    let (instructions, statistics) =
        board::instructions(|| draw_projected(frame, vertices, black_box(&mesh.colors), indices));
    let Statistics { samples_passed, primitives, .. } = statistics?;
    check(primitives == TRIANGLES as u64 && samples_passed == 4 * primitives)?;
    println!("small/instructions {instructions}");
    println!("small/triangles {primitives}");
    Some(())
}

fn check(is_right: bool) -> Option<()> {
    is_right.then_some(())
}

impl Mesh {
    fn fill(&mut self) {
        let size = f32::from(halfplane_firmware::SIZE);
        let row = QUADS[0] + 1;
        for y in 0..=QUADS[1] {
            for x in 0..row {
                let w = 1.0 + f32::from(x + y) / 16.0;
                let (x_ndc, y_ndc) = (f32::from(x) * 8.0 / size - 1.0, 1.0 - f32::from(y) * 4.0 / size);
                let at = usize::from(y * row + x);
                self.positions[at] = Vec4::new(x_ndc * w, y_ndc * w, 0.5 * w, w);
                self.colors[at] = Vec3::new(f32::from(x % 2), f32::from(y % 2), 0.5);
            }
        }
        let mut at = 0;
        for y in 0..QUADS[1] {
            for x in 0..QUADS[0] {
                let a = y * row + x;
                let (b, c, d) = (a + 1, a + row, a + row + 1);
                self.indices[at] = [a, c, b];
                self.indices[at + 1] = [b, c, d];
                at += 2;
            }
        }
    }
}
