//! The piece after the one that is drawn.
//!
//! How many samples a triangle up to eight pixels wide covers, and so how often each loop over them runs, no predictor can tell;
//! and it is known only at the end of a long chain: vertices, corners, edge functions, coverage. A processor that has guessed
//! wrong finds out then, and all that it did meanwhile is lost. So each piece is set up, and its coverage found out, while the one
//! before it still waits to be drawn: when its own turn comes, these branches need no guess. (Depth passes have no such loops.)
//!
//! For that, a piece waits in memory, which takes up to 80 instructions, or 10 with AVX2: where most pieces are minute, whose
//! coverage is known anyway, a loss of one or two hundredths of the time. Where a framebuffer lends no blocks, coverage is found out
//! again.

use crate::fan::{History, Piece};
use crate::target::Borders;
use crate::tiny::{NARROW_WINDOW, NarrowLanes, Outline, Tiny};

/// A piece that waits for its turn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Upcoming {
    pub(crate) piece: Piece,
    /// How it came about, if it is a piece of a clipped triangle; else left over.
    history: Option<History>,
    pub(crate) known: Known,
}

/// What is known of a piece before anything of it is drawn. What does not apply is left over from a piece before: nothing here
/// does if it is minute, and windows only if it is tiny.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Known {
    pub(crate) is_tiny: bool,
    /// Its windows.
    pub(crate) tiny: Tiny,
    /// Their covered lanes; none if they are wide, or if nothing may be drawn to: that is found out by them.
    pub(crate) covered_lanes: NarrowLanes,
}

/// A piece that is drawn, and one that waits.
#[derive(Debug)]
pub(crate) struct Turns {
    places: [Upcoming; 2],
    /// Where the next one is put.
    next: usize,
    is_waiting: bool,
}

impl Upcoming {
    /// None at all.
    const BLANK: Self = Self {
        piece: Piece::BLANK,
        history: None,
        known: Known { is_tiny: false, tiny: Tiny::BLANK, covered_lanes: [0; 2] },
    };

    /// Puts a piece here that lies within this outline, in a framebuffer that has `target`, of which `area` may be drawn to.
    #[inline(always)]
    pub(crate) fn set(
        &mut self,
        piece: &Piece,
        history: impl FnOnce() -> Option<History>,
        outline: impl FnOnce() -> Outline,
        (target, area): (Borders, Borders),
    ) {
        self.piece = *piece;
        if piece.in_fan > 0 {
            self.history = history();
        }
        if piece.covered == 0 {
            let Outline { bounds, is_tiny } = outline();
            self.known.is_tiny = is_tiny;
            if is_tiny {
                self.known.tiny = Tiny::new(&piece.setup, bounds, target, area);
                let tiny = &self.known.tiny;
                self.known.covered_lanes = if tiny.lanes <= NARROW_WINDOW && !tiny.is_empty() {
                    tiny.covered_lanes()
                } else {
                    [0; 2]
                };
            }
        }
    }

    #[inline(always)]
    pub(crate) fn history(&self) -> Option<&History> {
        if self.piece.in_fan > 0 { self.history.as_ref() } else { None }
    }
}

impl Turns {
    /// None waits.
    pub(crate) const fn new() -> Self {
        Self { places: [Upcoming::BLANK; 2], next: 0, is_waiting: false }
    }

    /// The place for the next piece.
    #[inline(always)]
    pub(crate) fn next(&mut self) -> &mut Upcoming {
        &mut self.places[self.next & 1]
    }

    /// From now on the next piece waits, if it is there. Whether one has waited: then it is [its turn](Self::this).
    #[inline(always)]
    pub(crate) fn pass(&mut self, is_there: bool) -> bool {
        self.next ^= 1;
        core::mem::replace(&mut self.is_waiting, is_there)
    }

    /// The piece whose turn it is, until the next one is put in its place. (Apart from `pass`: an `Option` of it took W3 one
    /// percent more instructions.)
    #[inline(always)]
    pub(crate) fn this(&self) -> &Upcoming {
        &self.places[self.next & 1]
    }
}
