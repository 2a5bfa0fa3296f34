//! The draws whose cost is measured: perspective-correct, depth-tested (`u16`, `Less`), RGB565, one smooth `Vec3`.
#![no_std]

pub mod board;
pub mod extras;

use halfplane::glam::{Vec3, Vec4};
use halfplane::{Primitives, Projected, Rasterizer, Statistics, Surface, Viewport, pack_rgb565};

/// Pixels along a side of the frame.
pub const SIZE: u16 = 128;
const PIXELS: usize = SIZE as usize * SIZE as usize;

/// What a firmware keeps of a picture, or of a tile of it.
pub struct Frame {
    pub color: [u16; PIXELS],
    pub depth: [u16; PIXELS],
}

impl Frame {
    pub const fn new() -> Self {
        Self { color: [0; PIXELS], depth: [u16::MAX; PIXELS] }
    }

    pub fn clear(&mut self) {
        self.color.fill(0);
        self.depth.fill(u16::MAX);
    }

    fn surface(&mut self) -> Option<Surface<&mut [u16], &mut [u16]>> {
        Surface::new(&mut self.color, &mut self.depth, u32::from(SIZE), u32::from(SIZE)).ok()
    }
}

impl Default for Frame {
    fn default() -> Self {
        Self::new()
    }
}

/// The state of both draws. The viewport is the frame.
pub fn rasterizer() -> Option<Rasterizer<Vec3>> {
    Some(Rasterizer::new(Viewport::of_size(u32::from(SIZE), u32::from(SIZE)).ok()?))
}

/// Draws triangles in clip space, with everything that may happen to them: the near plane, the guard band.
#[inline(never)]
pub fn draw(frame: &mut Frame, positions: &[Vec4], colors: &[Vec3], indices: &[u16]) -> Option<Statistics> {
    let list = Primitives::list().indexed(indices);
    rasterizer()?
        .draw(&mut frame.surface()?, list, positions, colors, |fragment| pack_rgb565(fragment.varyings()))
        .ok()
}

/// The same with vertices that were projected before.
#[inline(never)]
pub fn draw_projected(
    frame: &mut Frame,
    vertices: Projected<'_, &[Vec4]>,
    colors: &[Vec3],
    indices: &[u16],
) -> Option<Statistics> {
    let list = Primitives::list().indexed(indices);
    rasterizer()?
        .draw(&mut frame.surface()?, list, vertices, colors, |fragment| pack_rgb565(fragment.varyings()))
        .ok()
}
