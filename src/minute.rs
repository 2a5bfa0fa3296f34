//! Triangles of up to two by two samples: of a mesh finer than the screen, nearly all of them.
//!
//! The [sieve](crate::sieve) has found out which samples they cover, so there is nothing left to traverse. Each sample
//! is worked out alone, in as few steps as there are: most such triangles cover one.

#![expect(
    clippy::cast_possible_truncation,
    reason = "within three pixels edge functions and areas are under 2²¹, and places under 2⁵"
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
    covered: u32,
}

/// A covered sample.
pub(crate) struct Covered {
    pub(crate) x: i32,
    pub(crate) y: i32,
    /// Its place from the top left on, 16 a row: see [`place_of`](crate::packet::place_of).
    pub(crate) place: u32,
    /// The edge functions.
    pub(crate) edges: [f32; 3],
}

impl<'a> Minute<'a> {
    #[inline(always)]
    pub(crate) fn new(setup: &'a Setup, covered: u32) -> Self {
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
        // All three sum up to twice the area. (Wrapping: positions that are asked for again may make another triangle.)
        let [p, q, _] = self.setup.edges();
        let (e0, e1) = (p.at(x, y) as i32, q.at(x, y) as i32);
        let e2 = (self.setup.area2() as i32).wrapping_sub(e0).wrapping_sub(e1);
        let edges = [e0 as f32, e1 as f32, e2 as f32];
        Some(Covered { x, y, place: (dx + 16 * dy) as u32, edges })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::project::ProjectedVertex;

    #[test]
    fn samples_have_the_values_of_all_three_edge_functions() {
        let mut random = 1u32;
        let mut at = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            ((random >> 8) % 512).cast_signed() - 5000
        };
        let mut seen = 0;
        while seen < 1000 {
            let [a, b, c] = [(); 3].map(|()| ProjectedVertex::new(at(), at(), 0.5, 1.0).expect("in range"));
            let Some(setup) = Setup::new([a, b, c]) else { continue };
            for bit in 0..4u8 {
                let sample = Minute::new(&setup, 1 << bit).next().expect("one is covered");
                let Borders { left, top, .. } = setup.borders();
                let (dx, dy) = (i32::from(bit & 1), i32::from(bit >> 1));
                assert_eq!((sample.x, sample.y), (left + dx, top + dy), "{setup:?}");
                let expected = setup.edges().map(|edge| edge.at(sample.x, sample.y) as f32);
                assert_eq!(sample.edges, expected, "{setup:?} at {} {}", sample.x, sample.y);
            }
            seen += 1;
        }
    }
}
