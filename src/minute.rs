//! Triangles of up to two by two samples: of a mesh finer than the screen, nearly all of them.
//!
//! The [sieve](crate::geometry) has found out which samples they cover, so there is nothing left to traverse. Each sample
//! is worked out alone, in as few steps as there are: most such triangles cover one.

#![expect(
    clippy::cast_possible_truncation,
    reason = "within three pixels edge functions are under 2²¹, and places under 2⁵"
)]

use crate::setup::Setup;
use crate::target::Borders;

/// The covered samples of a minute triangle, from the top left on.
pub(crate) struct Minute<'a> {
    setup: &'a Setup,
    /// The pixel at the top left of its bounds, which places are counted from.
    pub(crate) x: i32,
    pub(crate) y: i32,
    /// Those of the samples that are still to come.
    covered: u8,
}

/// A covered sample.
pub(crate) struct Covered {
    pub(crate) x: i32,
    pub(crate) y: i32,
    /// Its place from the top left on, 16 a row: see [`place_of`](crate::packet::place_of).
    pub(crate) place: u8,
    /// The edge functions.
    pub(crate) edges: [f32; 3],
}

impl<'a> Minute<'a> {
    #[inline(always)]
    pub(crate) fn new(setup: &'a Setup, covered: u8) -> Self {
        let Borders { left, top, .. } = setup.borders();
        Self { setup, x: left, y: top, covered }
    }
}

impl Iterator for Minute<'_> {
    type Item = Covered;

    #[inline(always)]
    fn next(&mut self) -> Option<Covered> {
        if self.covered == 0 {
            return None;
        }
        let bit = self.covered.trailing_zeros() as i32;
        self.covered &= self.covered - 1;
        let (dx, dy) = (bit & 1, bit >> 1);
        let (x, y) = (self.x + dx, self.y + dy);
        let [p, q, _] = self.setup.edges();
        let (e0, e1) = (p.at(x, y) as i32, q.at(x, y) as i32);
        let e2 = (self.setup.area2() as i32).wrapping_sub(e0).wrapping_sub(e1);
        let edges = [e0 as f32, e1 as f32, e2 as f32];
        Some(Covered { x, y, place: (dx + 16 * dy) as u8, edges })
    }
}
