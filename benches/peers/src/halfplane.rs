//! This crate.

use crate::contestant::Contestant;
use crate::draw::Canvas;
use crate::workloads::{HEIGHT, Workload};

pub struct Halfplane {
    canvas: Canvas,
}

impl Halfplane {
    pub fn new() -> Self {
        Self { canvas: Canvas::new() }
    }
}

impl Contestant for Halfplane {
    fn name(&self) -> &str {
        "halfplane"
    }

    fn supports(&self, _: &Workload) -> bool {
        true
    }

    fn prepare(&mut self, workload: &Workload) {
        self.canvas.prepare(workload);
    }

    fn clear(&mut self) {
        self.canvas.clear();
    }

    fn draw(&mut self, workload: &Workload) {
        draw(&mut self.canvas, workload);
    }

    fn read_pixels(&mut self) -> Vec<u32> {
        self.canvas.color.clone()
    }

    fn read_depth(&mut self) -> Vec<f32> {
        self.canvas.depth.clone()
    }
}

/// One frame; if it is dispatched, compiled for the best of these that the processor has.
#[cfg_attr(
    feature = "dispatch",
    multiversion::multiversion(targets(
        "x86_64+avx512f+avx512bw+avx512cd+avx512dq+avx512vl+avx2+bmi1+bmi2+fma+lzcnt+popcnt",
        "x86_64+avx2+bmi1+bmi2+fma+lzcnt+popcnt"
    ))
)]
fn draw(canvas: &mut Canvas, workload: &Workload) {
    canvas.draw(workload, 0..HEIGHT);
}
