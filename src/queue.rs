//! Which triangles of a batch are still to be drawn.

#![expect(clippy::cast_possible_truncation, reason = "numbers are under 2⁶")]

use glam::Vec4;

use crate::traverse::HAS_FLOAT_LANES;

/// Numbers up to 63 in ascending order: a bit each.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Queue {
    bits: u64,
}

impl Queue {
    pub(crate) const EMPTY: Self = Self { bits: 0 };

    /// The numbers below `count`, which is up to 64; where there is no SIMD, up to 1.
    #[inline(always)]
    pub(crate) fn below(count: usize) -> Self {
        if !HAS_FLOAT_LANES || count == 0 {
            return Self { bits: u64::from(count > 0) };
        }
        Self { bits: u64::MAX >> 64usize.saturating_sub(count) }
    }

    /// The places of those words whose sign bit is clear. They are a multiple of four, and up to 64.
    #[inline(always)]
    pub(crate) fn of_clear_signs(words: &[u32]) -> Self {
        let mut bits = 0;
        for (four, shift) in words.chunks_exact(4).zip((0..64).step_by(4)) {
            if let &[a, b, c, d] = four {
                let signs = Vec4::from_array([a, b, c, d].map(f32::from_bits)).is_negative_bitmask();
                bits |= u64::from(!signs & 0b1111) << shift;
            }
        }
        Self { bits }
    }

    /// How many there are.
    #[inline(always)]
    pub(crate) fn len(self) -> usize {
        self.bits.count_ones() as usize
    }

    /// Takes out the first one.
    #[inline(always)]
    pub(crate) fn pop(&mut self) -> Option<usize> {
        if self.bits == 0 {
            return None;
        }
        if !HAS_FLOAT_LANES {
            // There is one at a time; and 64 bits are emulated.
            *self = Self::EMPTY;
            return Some(0);
        }
        let first = self.bits.trailing_zeros() as usize;
        self.bits &= self.bits - 1;
        Some(first)
    }

    /// Takes out this one, if it is there.
    #[inline(always)]
    pub(crate) fn remove(&mut self, number: usize) {
        self.bits &= !1u64.wrapping_shl(number as u32);
    }

    /// A few from all over: the first one of each eight numbers, and the last one of all.
    #[inline(always)]
    pub(crate) fn spread(self) -> impl Iterator<Item = usize> {
        let eights = (0..64).step_by(8).filter_map(move |at| Self { bits: self.bits & 0xFF << at }.pop());
        eights.chain(self.bits.checked_ilog2().map(|last| last as usize))
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    fn all(mut queue: Queue) -> Vec<usize> {
        let len = queue.len();
        let all: Vec<_> = core::iter::from_fn(|| queue.pop()).collect();
        assert_eq!(all.len(), len, "as many as it says");
        all
    }

    // Where there is no SIMD, a queue holds one number at most: see `Queue::pop`.

    #[test]
    fn numbers_come_in_order() {
        for count in [0, 1, 2, 31, 32, 33, 63, 64].into_iter().filter(|&count| count < 2 || HAS_FLOAT_LANES) {
            assert_eq!(all(Queue::below(count)), (0..count).collect::<Vec<_>>());
        }
        assert!(all(Queue::EMPTY).is_empty());
    }

    #[test]
    fn clear_signs_are_found_and_those_taken_out_that_are_removed() {
        if !HAS_FLOAT_LANES {
            return;
        }
        let word = |i: usize| if i % 3 == 1 { 1 << 31 | i as u32 } else { u32::MAX >> (i % 30 + 1) };
        let words: [u32; 64] = core::array::from_fn(word);
        for count in [0, 4, 16, 40, 64] {
            let mut queue = Queue::of_clear_signs(&words[..count]);
            assert_eq!(all(queue), (0..count).filter(|i| i % 3 != 1).collect::<Vec<_>>());
            for removed in [0, 7, 63] {
                queue.remove(removed);
            }
            let left = |i: &usize| i % 3 != 1 && ![0, 63].contains(i);
            assert_eq!(all(queue), (0..count).filter(left).collect::<Vec<_>>(), "7 was not there");
        }
    }

    #[test]
    fn some_are_from_all_over() {
        if !HAS_FLOAT_LANES {
            return;
        }
        let mut queue = Queue::below(20);
        for absent in [0, 1, 4, 5, 6, 7, 8, 12, 13, 14, 15, 16, 18] {
            queue.remove(absent);
        }
        assert_eq!(queue.spread().collect::<Vec<_>>(), [2, 9, 17, 19]);
        let ends = [0, 8, 16, 24, 32, 40, 48, 56, 63];
        assert_eq!(Queue::below(64).spread().collect::<Vec<_>>(), ends);
        assert_eq!(Queue::EMPTY.spread().count(), 0);
    }
}
