//! Coarse depth: one bound for each 64 depths of a row, so that what is hidden is left out before a depth is read.
//!
//! Along a row depth is monotonic, roundings and all: of a triangle's samples in a segment, the nearest and the farthest
//! are at its ends. Nothing that is stored is farther than the bound: if the nearest sample is, none passes. And where a
//! triangle covers a whole segment, nothing that is stored there afterwards is farther than its farthest.
//!
//! (One level of Greene's, Kass's and Miller's "Hierarchical Z-Buffer Visibility", 1993. Rows instead of squares suit
//! spans: such bounds are exact, and cost one sum each.)

#![expect(clippy::cast_possible_truncation, reason = "a segment has 64 pixels")]

use glam::Vec4;

use crate::depth::{CompareOp, DepthFormat, DepthTest};
use crate::plane::RowPlane;
use crate::target::{Absent, Block, Bounds, DOMAIN, Framebuffer, Rect, Run, Surface, SurfaceError};
use crate::tiny::{COLUMNS, NEGATIVE};

/// How many pixels of a row share a bound.
const SEGMENT: usize = 64;

/// How many bounds are looked at at a time.
const QUAD: usize = 4;

/// A framebuffer that remembers how near at least what it shows is: what lies behind is left out 64 pixels at a time,
/// before a depth is read. The picture is the same to the bit, and so is what a draw tells.
///
/// It pays where large triangles hide others: hidden full-screen layers take a quarter of the instructions that comparing
/// their depths takes (with AVX2, two fifths), and next to no memory traffic. Triangles less than 64 pixels wide go past
/// it, at no cost; where nothing is hidden, wide ones pay a twentieth.
///
/// * **Memory**: [`bounds_len`](CoarseDepth#method.bounds_len) depths, one for 64 in a row of the depth buffer. Before the
///   first draw, whenever the depth buffer is cleared, in whole or in part, and after anything but draws through this
///   framebuffer has written to it, fill them with the farthest depth: `from_depth(1.0)`, or for reverse Z
///   `from_depth(0.0)`, of the [depth format](DepthFormat). That one says that nothing is known. So too if the same memory
///   is to serve another area or another direction.
/// * **Test**: bounds are kept for tests of one direction, that of the test given to [`new`](Self::new):
///   [`Less`](crate::Less) and [`LessOrEqual`](crate::LessOrEqual), or [`Greater`](crate::Greater) and
///   [`GreaterOrEqual`](crate::GreaterOrEqual). Draws that compare otherwise are right as well: if they write depth, each
///   forgets the bounds of the rows that it may draw to.
/// * **What is learnt**: in a row that a triangle is seen in, each of the 64-pixel segments that it covers from end to end
///   gets a bound, if the test writes depth. Not where a fragment of that row was discarded: what is alpha-tested hides
///   nothing early.
/// * **Tiles, bands, threads**: each has bounds of its own.
///
/// Targets without SIMD draw as if it were not there, and do not touch the bounds.
///
/// # Examples
/// ```
/// use halfplane::{CoarseDepth, Less, Primitives, Rasterizer, Rect, Surface, Viewport, glam::Vec4};
/// # let triangle = |z| [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)].map(|(x, y)| Vec4::new(x, y, z, 1.0));
/// # let (near, far) = (triangle(0.25), triangle(0.75));
/// let (mut color, mut depth) = (vec![0u32; 640 * 480], vec![0.0f32; 640 * 480]);
/// let mut bounds = vec![0.0; CoarseDepth::bounds_len(Rect::of_size(640, 480))];
/// let rasterizer = Rasterizer::<()>::new(Viewport::of_size(640, 480)?);
/// for _frame in 0..2 {
///     depth.fill(1.0);
///     bounds.fill(1.0);
///     let surface = Surface::new(&mut color, &mut depth, 640, 480)?;
///     let mut target = CoarseDepth::new(surface, &mut bounds, Less)?;
///     rasterizer.draw(&mut target, Primitives::list(), &near, (), |_| 1u32)?;
///     let hidden = rasterizer.draw(&mut target, Primitives::list(), &far, (), |_| 2u32)?;
///     assert_eq!(hidden.fragments, 0);
/// }
/// # #[cfg(target_arch = "x86_64")]
/// assert!(bounds.contains(&0.25));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct CoarseDepth<'m, F: Framebuffer> {
    target: F,
    bounds: &'m mut [F::Depth],
    /// How many there are for a row.
    columns: usize,
    /// The first row.
    top: i32,
    are_upper: bool,
}

// Of any one type, so that nobody has to say of which.
impl CoarseDepth<'_, Surface<Absent, Absent>> {
    /// How many bounds a framebuffer with this area takes: for each row, four for each 256 pixels.
    ///
    /// ```
    /// # use halfplane::{CoarseDepth, Rect};
    /// assert_eq!(CoarseDepth::bounds_len(Rect::of_size(1920, 1080)), 32 * 1080);
    /// ```
    #[must_use]
    pub const fn bounds_len(area: Rect) -> usize {
        columns(area).saturating_mul(area.height as usize)
    }
}

/// How many bounds a row has.
const fn columns(area: Rect) -> usize {
    (area.width as usize).div_ceil(QUAD * SEGMENT) * QUAD
}

impl<'m, F: Framebuffer> CoarseDepth<'m, F> {
    /// `target` with `bounds`, for draws with this test or another of the same direction.
    ///
    /// # Errors
    /// When there are fewer than [`bounds_len`](CoarseDepth#method.bounds_len) bounds, or when the test has no direction.
    pub fn new(target: F, bounds: &'m mut [F::Depth], test: impl DepthTest) -> Result<Self, SurfaceError> {
        let (len, needed) = (bounds.len(), CoarseDepth::bounds_len(target.area()));
        if len < needed {
            return Err(SurfaceError::TooShort { plane: "bounds", len, needed });
        }
        let Some(are_upper) = direction(test) else {
            return Err(SurfaceError::NoDirection { compare: test.compare() });
        };
        let Rect { y: top, .. } = target.area();
        Ok(Self { columns: columns(target.area()), target, bounds, top, are_upper })
    }
}

impl<F: Framebuffer> Framebuffer for CoarseDepth<'_, F> {
    type Color = F::Color;
    type Depth = F::Depth;

    fn area(&self) -> Rect {
        self.target.area()
    }

    #[inline(always)]
    fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, F::Color, F::Depth> {
        self.target.run(x, y, len)
    }

    #[inline(always)]
    fn block(
        &mut self,
        x: i32,
        y: i32,
        width: usize,
        height: usize,
    ) -> Option<Block<'_, F::Color, F::Depth>> {
        self.target.block(x, y, width, height)
    }

    #[inline(always)]
    fn bounds(&mut self, y: i32) -> Option<Bounds<'_, F::Depth>> {
        let start = (y.wrapping_sub(self.top) as usize).wrapping_mul(self.columns);
        let segments = self.bounds.get_mut(start..start.wrapping_add(self.columns))?;
        Some(Bounds { segments, are_upper: self.are_upper })
    }
}

/// Whether bounds, upper or lower ones, stay true whatever is drawn with a test: nothing that it lets pass is farther
/// than what was there. And so, nothing behind a bound passes.
#[inline(always)]
fn keeps(test: impl DepthTest, are_upper: bool) -> bool {
    use CompareOp::{Equal, Greater, GreaterOrEqual, Less, LessOrEqual, Never};
    match test.compare() {
        Some(Never | Equal) => true,
        Some(Less | LessOrEqual) => are_upper,
        Some(Greater | GreaterOrEqual) => !are_upper,
        _ => false,
    }
}

/// True if a test lets pass only what is less than what is there, false if only what is greater, equal ones or not; or neither.
#[inline(always)]
pub(crate) fn direction(test: impl DepthTest) -> Option<bool> {
    let (less, greater) = (keeps(test, true), keeps(test, false));
    if less == greater { None } else { Some(less) }
}

/// What a draw does with a framebuffer's bounds.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coarse {
    /// Whether what lies behind them is left out.
    rejects: bool,
    /// Whether they come nearer by what is drawn.
    pub(crate) learns: bool,
    /// The borders of the framebuffer.
    left: i32,
    right: i32,
}

/// A triangle's depth on a row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DepthRow<'a> {
    pub(crate) plane: RowPlane<'a>,
    pub(crate) y: i32,
    /// At this column.
    pub(crate) z: f32,
    pub(crate) anchor: i32,
}

impl DepthRow<'_> {
    /// Whether depth grows to the right.
    #[inline(always)]
    fn first_is_less(&self) -> bool {
        self.plane.step_x() > 0.0
    }
}

/// Which segments of a row are hidden, a bit each.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Hidden {
    segments: u64,
    /// The first column.
    left: i32,
}

impl Hidden {
    /// How many segments there are at most.
    const SEGMENTS: usize = 64;

    /// One past the last column.
    #[inline(always)]
    pub(crate) fn right(&self) -> i32 {
        self.left.wrapping_add((Self::SEGMENTS * SEGMENT) as i32)
    }
}

impl Coarse {
    /// For a draw to some rows of a framebuffer. Bounds that it would make untrue are forgotten.
    #[inline(always)]
    pub(crate) fn new<F: Framebuffer>(target: &mut F, area: Rect, test: impl DepthTest) -> Self {
        let frame = target.area();
        let mut coarse = Self { rejects: false, learns: false, left: frame.x, right: frame.right() };
        // If some of the frame is out of reach, its numbers might overflow.
        if area.is_empty() || frame.intersection(DOMAIN) != frame {
            return coarse;
        }
        for y in area.y..area.bottom() {
            let Some(Bounds { segments, are_upper }) = target.bounds(y) else { break };
            if keeps(test, are_upper) {
                coarse.rejects = true;
                coarse.learns = test.writes() && keeps(test, are_upper) != keeps(test, !are_upper);
                break;
            }
            if !test.writes() {
                break;
            }
            segments.fill(F::Depth::from_depth(if are_upper { 1.0 } else { 0.0 }));
        }
        coarse
    }

    /// Which segments of a row are hidden, from column `x` on.
    #[inline(always)]
    pub(crate) fn hidden<F: Framebuffer>(
        &self,
        target: &mut F,
        row: DepthRow<'_>,
        (x, end): (i32, i32),
    ) -> Hidden {
        let first = x.wrapping_sub(self.left).unsigned_abs() as usize / SEGMENT / QUAD * QUAD;
        let left = self.left.wrapping_add((first * SEGMENT) as i32);
        let mut hidden = Hidden { segments: 0, left };
        if !self.rejects || end - x < SEGMENT as i32 {
            return hidden;
        }
        let Some(Bounds { segments, are_upper }) = target.bounds(row.y) else { return hidden };
        let nearer = if row.first_is_less() == are_upper { 0 } else { SEGMENT as i32 - 1 };
        let dx = |x: i32| (x - row.anchor) as f32;
        let (from, to) = (Vec4::splat(dx(x)), Vec4::splat(dx(end - 1)));
        let mut column = COLUMNS * SEGMENT as f32 + dx(left + nearer);
        let count = ((end - left) as usize).div_ceil(SEGMENT).min(Hidden::SEGMENTS);
        let bounds = segments.get(first..).unwrap_or_default();
        for (bounds, place) in bounds.chunks_exact(QUAD).zip((0..count).step_by(QUAD)) {
            let mut lanes = row.plane.moved_four(row.z, column.max(from).min(to)).to_array();
            for (lane, &bound) in lanes.iter_mut().zip(bounds) {
                let nearest = F::Depth::from_depth(*lane);
                let is_hidden = if are_upper { nearest > bound } else { nearest < bound };
                *lane = if is_hidden { NEGATIVE } else { 0.0 };
            }
            hidden.segments |= u64::from(Vec4::from_array(lanes).is_negative_bitmask()) << place;
            column += (QUAD * SEGMENT) as f32;
        }
        hidden
    }

    /// Of columns `x .. end` of a row, how many from the first on are hidden, or how many may be seen: up to `limit` or a
    /// little less, so that no segment is cut in two. And which of both. The limit is a segment at least.
    #[inline(always)]
    pub(crate) fn stretch(&self, hidden: Hidden, (x, end): (i32, i32), limit: i32) -> (i32, bool) {
        if !self.rejects {
            return (limit.min(end - x), false);
        }
        // Without signs, for no column is left of what is known: shifts and masks, not divisions that round towards zero.
        let (dx, left, limit) = ((x - hidden.left) as u32, (end - x) as u32, limit as u32);
        let segments = hidden.segments >> (dx / SEGMENT as u32);
        let is_hidden = segments & 1 == 1;
        let count = if is_hidden { segments.trailing_ones() } else { segments.trailing_zeros() };
        let len = left.min(count * SEGMENT as u32 - dx % SEGMENT as u32);
        if is_hidden || len <= limit {
            return (len as i32, is_hidden);
        }
        ((limit - (dx + limit) % SEGMENT as u32) as i32, false)
    }

    /// Columns `x .. end` of a row have been tested, and written where they passed: nothing is left there that lies behind
    /// them.
    #[inline(always)]
    pub(crate) fn learn<F: Framebuffer>(&self, target: &mut F, row: DepthRow<'_>, (x, end): (i32, i32)) {
        if end - x < SEGMENT as i32 {
            return;
        }
        let Some(Bounds { segments, are_upper }) = target.bounds(row.y) else { return };
        let first_is_farther = row.first_is_less() != are_upper;
        let dx = |x: i32| (x - row.anchor) as f32;
        let (start, end, border) = (dx(x), dx(end), Vec4::splat(dx(self.right)));
        let farther = if first_is_farther { 0.0 } else { (SEGMENT - 1) as f32 };
        let first = (x - self.left) as usize / SEGMENT / QUAD * QUAD;
        let mut left = COLUMNS * SEGMENT as f32 + dx(self.left + (first * SEGMENT) as i32);
        for bounds in segments.get_mut(first..).unwrap_or_default().chunks_exact_mut(QUAD) {
            let right = (left + SEGMENT as f32).min(border);
            let farthest = row.plane.moved_four(row.z, (left + farther).min(border - 1.0));
            let (from, to, farthest) = (left.to_array(), right.to_array(), farthest.to_array());
            if from[0] >= end {
                break;
            }
            for (i, bound) in bounds.iter_mut().enumerate() {
                let farthest = F::Depth::from_depth(farthest[i]);
                let is_farther = if are_upper { *bound > farthest } else { *bound < farthest };
                *bound = if (from[i] >= start) & (to[i] <= end) & is_farther { farthest } else { *bound };
            }
            left += (QUAD * SEGMENT) as f32;
        }
    }
}
