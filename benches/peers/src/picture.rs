//! Whether two contestants drew the same picture, and PNG files to see with one's own eyes.

use std::fs::File;
use std::io::BufWriter;
use std::path::Path;

use crate::contestant::Contestant;
use crate::workloads::{HEIGHT, Shading, WIDTH, Workload};

/// Share of the pixels that may differ: edges that fall on a sample, and borders between a checker's cells.
pub const MAY_DIFFER: f64 = 0.002;

/// What a contestant drew.
pub enum Picture {
    Color(Vec<u32>),
    Depth(Vec<f32>),
}

impl Picture {
    pub fn read(contestant: &mut dyn Contestant, workload: &Workload) -> Self {
        match workload.shading {
            Shading::DepthOnly => Self::Depth(contestant.read_depth()),
            _ => Self::Color(contestant.read_pixels()),
        }
    }

    /// Pixels that differ by more than 8 of 255 in any channel, or by more than 10⁻⁴ in depth.
    pub fn differing(&self, other: &Self) -> usize {
        match (self, other) {
            (Self::Color(a), Self::Color(b)) => {
                let differ = |a: &u32, b: &u32| {
                    a.to_le_bytes().iter().zip(b.to_le_bytes()).any(|(a, b)| a.abs_diff(b) > 8)
                };
                a.iter().zip(b).filter(|(a, b)| differ(a, b)).count()
            }
            (Self::Depth(a), Self::Depth(b)) => {
                a.iter().zip(b).filter(|(a, b)| ((*a - *b).abs() > 1e-4) || a.is_nan() != b.is_nan()).count()
            }
            _ => usize::MAX,
        }
    }

    /// Writes an RGBA8 or, for depth, a grey PNG: near is bright, stretched over the depths that occur.
    pub fn save(&self, path: &Path) -> Result<(), Box<dyn std::error::Error>> {
        let mut encoder = png::Encoder::new(BufWriter::new(File::create(path)?), WIDTH, HEIGHT);
        encoder.set_depth(png::BitDepth::Eight);
        let bytes: Vec<u8> = match self {
            Self::Color(pixels) => {
                encoder.set_color(png::ColorType::Rgba);
                pixels.iter().flat_map(|pixel| pixel.to_le_bytes()).collect()
            }
            Self::Depth(depths) => {
                encoder.set_color(png::ColorType::Grayscale);
                let drawn = || depths.iter().copied().filter(|&depth| depth < 1.0);
                let (low, high) = (drawn().fold(1.0, f32::min), drawn().fold(0.0, f32::max));
                let grey = |depth: f32| 255.0 - 191.0 * (depth - low) / (high - low);
                depths.iter().map(|&depth| if depth < 1.0 { grey(depth) as u8 } else { 0 }).collect()
            }
        };
        Ok(encoder.write_header()?.write_image_data(&bytes)?)
    }
}
