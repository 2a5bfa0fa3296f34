//! What the benches share: settings, random numbers, and geometry whose coverage is known.

#![allow(dead_code, unreachable_pub, reason = "each bench uses a part")]

use core::time::Duration;

use criterion::Criterion;
use halfplane::glam::Vec4;
use halfplane::{ProjectedVertex, SUBPIXELS};

/// Whether this run measures. `cargo test --benches` runs everything once, to see that it works.
pub fn is_timed() -> bool {
    std::env::args().any(|argument| argument == "--bench")
}

/// Runs benches with settings under which all of them take a few minutes.
pub fn run(benches: impl FnOnce(&mut Criterion)) {
    let mut criterion = Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(300))
        .measurement_time(Duration::from_secs(2))
        .configure_from_args();
    benches(&mut criterion);
    criterion.final_summary();
}

/// `SplitMix64` (Steele, Lea, Flood 2014).
pub struct Random(pub u64);

impl Random {
    /// In 0 .. 1.
    pub fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 40) as f32 * (1.0 / 16_777_216.0)
    }
}

/// A vertex at whole pixels.
pub fn vertex(x: i32, y: i32) -> ProjectedVertex {
    ProjectedVertex::new(x * SUBPIXELS, y * SUBPIXELS, 0.5, 1.0).expect("inside the guard band")
}

/// Two triangles over the whole viewport, in perspective: w goes from 1 to 4 from left to right, depth from 0.25 to 1.
pub const SQUARE: [Vec4; 4] = [
    Vec4::new(-1.0, -1.0, 0.25, 1.0),
    Vec4::new(4.0, -4.0, 4.0, 4.0),
    Vec4::new(-1.0, 1.0, 0.25, 1.0),
    Vec4::new(4.0, 4.0, 4.0, 4.0),
];

/// Its indices.
pub const SQUARE_INDICES: [u8; 6] = [0, 1, 2, 2, 1, 3];
