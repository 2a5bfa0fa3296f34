//! The two buffers of the contestants that draw into plain memory.

use crate::workloads::{CLEAR_COLOR, CLEAR_DEPTH, HEIGHT, WIDTH};

/// Pixels in a picture.
pub const PIXELS: usize = WIDTH as usize * HEIGHT as usize;

/// Colour and depth, top row first.
pub struct Frame {
    pub color: Vec<u32>,
    pub depth: Vec<f32>,
}

impl Frame {
    pub fn new() -> Self {
        Self { color: vec![CLEAR_COLOR; PIXELS], depth: vec![CLEAR_DEPTH; PIXELS] }
    }

    pub fn clear(&mut self) {
        self.color.fill(CLEAR_COLOR);
        self.depth.fill(CLEAR_DEPTH);
    }
}
