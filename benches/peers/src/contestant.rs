//! What a rasterizer must do to take part.

use crate::workloads::Workload;

/// A rasterizer that draws into a colour and a depth buffer of its own.
pub trait Contestant {
    /// The table's column.
    fn name(&self) -> &str;

    /// Whether it can draw this at all: without near clipping, blending or derivatives some can't.
    fn supports(&self, workload: &Workload) -> bool;

    /// Whatever a program does once for each mesh: uploads, conversions, shaders. Not timed.
    fn prepare(&mut self, workload: &Workload);

    /// Fills both buffers. Not timed.
    fn clear(&mut self);

    /// Draws the workload that was prepared, and returns when the pixels are in memory. Timed.
    fn draw(&mut self, workload: &Workload);

    /// RGBA8, red in the lowest byte, top row first.
    fn read_pixels(&mut self) -> Vec<u32>;

    /// Depth in \[0, 1\], top row first.
    fn read_depth(&mut self) -> Vec<f32>;
}
