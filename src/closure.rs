//! What a draw shades fragments with: one closure, or two with [`Columns`] between them. Here are the shading loops.
//!
//! They run over arrays, and the closure is inlined into them, so the compiler makes SIMD of the whole.

#![expect(clippy::cast_possible_truncation, reason = "a packet has at most 2⁸ fragments")]

use crate::columns::Columns;
use crate::depth::{DepthFormat, DepthTest};
use crate::fragment::{Fragment, Shading};
use crate::interpolate::Varyings;
use crate::packet::{GROUP, PACKET, RAMP, Samples};
use crate::traverse::HAS_WIDE_LANES;

/// How a closure, or two, wants its packets.
pub(crate) trait Closure {
    /// Whether it may hold a reference, to a texture say, and so may read memory. For all that the compiler knows, that is the
    /// framebuffer's, which the shading loop would write to: it would not become SIMD. So such a closure shades into the packet's
    /// pixels, which nobody else can see; others, which hold nothing or a few numbers, spare themselves the copy.
    const MAY_READ: bool;

    /// What becomes of the lanes up to the next multiple of [`GROUP`], where fragments are shaded in the packet.
    const PADDING: Padding;
}

/// See [`Closure::PADDING`].
#[derive(Clone, Copy, Debug)]
pub(crate) enum Padding {
    /// There are none: what is left over after SIMD is shaded one by one.
    None,
    /// They get any colour, and the closure is not called for them.
    Skipped,
    /// They are shaded like the others, each as if it were the first fragment: what a closure is not called for otherwise, it is not
    /// called for here.
    Shaded,
}

impl Padding {
    /// How many lanes are shaded for `count` fragments from `begin` on.
    #[inline(always)]
    pub(crate) fn lanes(self, begin: usize, count: usize) -> usize {
        let padded = count.next_multiple_of(GROUP);
        let is_padded = match self {
            Self::None => false,
            // One or two stay alone: six or seven lanes more cost more.
            Self::Skipped => count > 2,
            Self::Shaded => begin + padded <= PACKET,
        };
        if is_padded { padded } else { count }
    }
}

/// What gives a colour, or an `Option` of it, to fragments of triangles with values `V` over a colour that is there.
pub(crate) trait Shade<V, C>: Closure {
    /// The colour of one fragment.
    fn shade(&mut self, fragment: Fragment<'_, V>, old: C) -> Option<C>;

    /// Shades the first `count` of some samples, fragments all of which pass the depth test. Gives how many of them were discarded.
    /// The others are padding: they get any colour, and nobody writes them out.
    ///
    /// What is written to are arguments, each by itself: that no mutable reference overlaps with another one is told to LLVM where a
    /// function is called, and not where they are made. Without it, each loop begins with up to a hundred comparisons of
    /// addresses; only a count of instructions would show that.
    #[expect(
        clippy::too_many_arguments,
        reason = "arrays that do not overlap are told apart as arguments only"
    )]
    fn shade_packet<D: DepthFormat>(
        &mut self,
        test: impl DepthTest,
        shading: &Shading<'_, V>,
        samples: Samples<'_>,
        count: usize,
        colors: &mut [C],
        depths: &mut [D],
        discarded: &mut [u32],
    ) -> u32;
}

/// One closure.
pub(crate) struct Whole<S>(pub(crate) S);

impl<S> Closure for Whole<S> {
    /// Nobody can be asked that, so alignment is looked at: what is aligned like a reference counts as one, a `u64` and a `Vec4`
    /// too. A wrong guess costs time, and nothing else.
    const MAY_READ: bool = size_of::<S>() > 0 && align_of::<S>() >= align_of::<&u8>();

    /// Up to seven fragments that are left over after SIMD, one by one, are a tenth of a fine mesh's time where it has eight lanes;
    /// where it has four, they are a fiftieth, as much as the condition costs others. Not where the closure may read: what it reads
    /// may not be there where it is not called.
    const PADDING: Padding = if HAS_WIDE_LANES && !Self::MAY_READ { Padding::Skipped } else { Padding::None };
}

impl<V, C, S, R> Shade<V, C> for Whole<S>
where
    V: Varyings,
    C: Copy,
    S: FnMut(Fragment<'_, V>, C) -> R,
    R: Into<Option<C>>,
{
    #[inline(always)]
    fn shade(&mut self, fragment: Fragment<'_, V>, old: C) -> Option<C> {
        (self.0)(fragment, old).into()
    }

    #[inline(always)]
    fn shade_packet<D: DepthFormat>(
        &mut self,
        test: impl DepthTest,
        shading: &Shading<'_, V>,
        samples: Samples<'_>,
        count: usize,
        colors: &mut [C],
        depths: &mut [D],
        discarded: &mut [u32],
    ) -> u32 {
        let skips = const { matches!(Self::PADDING, Padding::Skipped) };
        let (is_padded, mut lost) = (skips && count < colors.len(), 0u32);
        let Some(&filler) = colors.first() else { return 0 };
        let count = count as u32 as f32;
        // Two loops in one, of which one is skipped, so that the closure is called in one place. If it is not too large, the
        // compiler makes two of it again, and there is nothing to choose between where there is no padding.
        for round in 0..if skips { 2 } else { 1 } {
            let has_padding = round == 1;
            if has_padding != is_padded {
                continue;
            }
            let len = samples.z.len();
            // All are as long already. Said again, for the compiler.
            let Some(samples) = samples.part(0..len) else { return 0 };
            if len > PACKET || (colors.len(), depths.len(), discarded.len()) != (len, len, len) {
                return 0;
            }
            // Never: with padding, there are whole groups (`Padding::lanes`). Said, so that the compiler makes no loop for what would be
            // left over after SIMD, and keeps nothing for it.
            if has_padding && len % GROUP != 0 {
                return 0;
            }
            // Results are selected, not branched on, so that a discard vectorises too.
            for i in 0..len {
                let fragment = samples.fragment(i, shading);
                let (old_color, old_depth) = (colors[i], depths[i]);
                let depth = D::from_depth(fragment.depth);
                if test.writes() {
                    // Before the closure is called, and taken back if it discards: past a store, LLVM does not move the loads above
                    // to where it is called. There they would be masked, one lane read and the next not, which is slow.
                    depths[i] = depth;
                }
                let is_padding = has_padding & (count <= RAMP[i]);
                let shaded = if is_padding { Some(filler) } else { (self.0)(fragment, old_color).into() };
                let is_kept = shaded.is_some();
                colors[i] = shaded.unwrap_or(old_color);
                if !is_kept & test.writes() {
                    depths[i] = old_depth;
                }
                discarded[i] |= u32::from(!is_kept);
                lost += u32::from(!is_kept);
            }
        }
        lost
    }
}

/// Two closures: what the first gives for all fragments of a packet waits in columns for the second.
pub(crate) struct InStages<'a, M: Columns, A, B> {
    /// By reference here, and not as a closure that is one: each of the two is called directly.
    pub(crate) first: &'a A,
    pub(crate) second: B,
    pub(crate) columns: &'a mut M::Arrays,
}

impl<M: Columns, A, B> Closure for InStages<'_, M, A, B> {
    /// That is what they are for.
    const MAY_READ: bool = true;

    /// They may be called again, so no fragment is left over after SIMD.
    const PADDING: Padding = Padding::Shaded;
}

impl<V, C, M, A, B, R> Shade<V, C> for InStages<'_, M, A, B>
where
    V: Varyings,
    C: Copy,
    M: Columns,
    A: Fn(Fragment<'_, V>) -> M,
    B: Fn(M, C) -> R,
    R: Into<Option<C>>,
{
    #[inline(always)]
    fn shade(&mut self, fragment: Fragment<'_, V>, old: C) -> Option<C> {
        (self.second)((self.first)(fragment), old).into()
    }

    #[inline(always)]
    fn shade_packet<D: DepthFormat>(
        &mut self,
        test: impl DepthTest,
        shading: &Shading<'_, V>,
        samples: Samples<'_>,
        count: usize,
        colors: &mut [C],
        depths: &mut [D],
        discarded: &mut [u32],
    ) -> u32 {
        Self::begin(self.first, shading, samples, count, self.columns);
        Self::finish(&self.second, test, samples.z, count, self.columns, colors, depths, discarded)
    }
}

impl<M: Columns, A, B> InStages<'_, M, A, B> {
    /// The first stage.
    #[inline(always)]
    fn begin<V: Varyings>(
        first: &A,
        shading: &Shading<'_, V>,
        samples: Samples<'_>,
        count: usize,
        columns: &mut M::Arrays,
    ) where
        A: Fn(Fragment<'_, V>) -> M,
    {
        let len = samples.z.len().min(PACKET);
        let Some(samples) = samples.part(0..len) else { return };
        if len == 0 {
            return;
        }
        let (one, count) = (samples.fragment(0, shading), count as u32 as f32);
        for (i, &number) in RAMP.iter().enumerate().take(len) {
            let is_padding = count <= number;
            first(samples.fragment(i, shading).or(&one, is_padding)).put(columns, i);
        }
    }

    /// The second one. Gives how many fragments were discarded.
    #[inline(always)]
    #[expect(
        clippy::too_many_arguments,
        reason = "arrays that do not overlap are told apart as arguments only"
    )]
    fn finish<C: Copy, D: DepthFormat, R: Into<Option<C>>>(
        second: &B,
        test: impl DepthTest,
        z: &[f32],
        count: usize,
        columns: &M::Arrays,
        colors: &mut [C],
        depths: &mut [D],
        discarded: &mut [u32],
    ) -> u32
    where
        B: Fn(M, C) -> R,
    {
        let (len, count, mut lost) = (z.len(), count as u32 as f32, 0);
        // All are as long, and none is empty. Said again, for the compiler.
        if len == 0 || len > PACKET || (colors.len(), depths.len(), discarded.len()) != (len, len, len) {
            return 0;
        }
        let one_color = colors[0];
        for i in 0..len {
            let (old_color, old_depth) = (colors[i], depths[i]);
            let is_padding = count <= RAMP[i];
            // Padding is the first fragment again, over the same colour: what stands in its own lane came out of another packet.
            let below = if is_padding { one_color } else { old_color };
            let shaded: Option<C> = second(M::get(columns, i), below).into();
            let is_kept = shaded.is_some();
            colors[i] = shaded.unwrap_or(old_color);
            if test.writes() {
                depths[i] = if is_kept { D::from_depth(z[i]) } else { old_depth };
            }
            let is_lost = !is_kept & !is_padding;
            discarded[i] |= u32::from(is_lost);
            lost += u32::from(is_lost);
        }
        lost
    }
}
