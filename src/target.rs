//! Where a picture goes: rectangles, and memory that the caller owns.
//!
//! A framebuffer is asked for *runs*: `len` neighbouring pixels of one row, as slices of colour and of depth. One
//! bounds check serves a whole run, and slices are what lets the compiler turn a shading loop into SIMD. Every
//! framebuffer speaks global coordinates, so a band or a tile of a frame is a framebuffer like the whole of it.

use crate::depth::{CompareOp, DepthFormat};

/// Framebuffer coordinates that exist: −[`EXTENT`] ≤ x, y < [`EXTENT`]. 2¹⁴ pixels are 2²² subpixels, the most that
/// snapping rounds exactly. Samples outside are never covered.
pub const EXTENT: i32 = 1 << 14;

/// A rectangle of pixels: columns `x .. x + width`, rows `y .. y + height`, y down. Any value is legal, and one
/// without pixels is empty.
///
/// ```
/// use halfplane::Rect;
/// let frame = Rect::of_size(640, 480);
/// let tile = Rect { x: 600, y: 470, width: 64, height: 64 };
/// assert_eq!(frame.intersection(tile), Rect { x: 600, y: 470, width: 40, height: 10 });
/// assert!(frame.contains(639, 0) && !frame.contains(640, 0));
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Rect {
    /// The first column.
    pub x: i32,
    /// The first row, the topmost one.
    pub y: i32,
    /// How many columns.
    pub width: u32,
    /// How many rows.
    pub height: u32,
}

/// A rectangle of pixels by its borders: its first column and row, and one past its last ones. What a [`Rect`] is made into
/// once and compared with for each triangle: its right and bottom borders are sums that must not overflow.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Borders {
    pub(crate) left: i32,
    pub(crate) top: i32,
    pub(crate) right: i32,
    pub(crate) bottom: i32,
}

impl Borders {
    /// What both have in common.
    #[inline(always)]
    pub(crate) fn intersection(self, other: Self) -> Self {
        Self {
            left: self.left.max(other.left),
            top: self.top.max(other.top),
            right: self.right.min(other.right),
            bottom: self.bottom.min(other.bottom),
        }
    }

    /// Whether both have a pixel in common.
    #[inline(always)]
    pub(crate) fn overlaps(self, other: Self) -> bool {
        let Self { left, top, right, bottom } = self.intersection(other);
        (left < right) & (top < bottom)
    }
}

impl Rect {
    /// `width` × `height` pixels with the top left one at (0, 0).
    #[must_use]
    pub const fn of_size(width: u32, height: u32) -> Self {
        Self { x: 0, y: 0, width, height }
    }

    /// Columns `left .. right` of rows `top .. bottom`; empty when an end comes before its start.
    #[must_use]
    pub(crate) const fn from_edges(left: i32, top: i32, right: i32, bottom: i32) -> Self {
        let width = if right > left { right.abs_diff(left) } else { 0 };
        let height = if bottom > top { bottom.abs_diff(top) } else { 0 };
        Self { x: left, y: top, width, height }
    }

    /// The same by its borders.
    #[inline(always)]
    pub(crate) const fn borders(self) -> Borders {
        Borders { left: self.x, top: self.y, right: self.right(), bottom: self.bottom() }
    }

    /// One past the last column, at most `i32::MAX`.
    #[must_use]
    pub const fn right(self) -> i32 {
        self.x.saturating_add_unsigned(self.width)
    }

    /// One past the last row, at most `i32::MAX`.
    #[must_use]
    pub const fn bottom(self) -> i32 {
        self.y.saturating_add_unsigned(self.height)
    }

    /// Whether it has no pixel.
    #[must_use]
    pub const fn is_empty(self) -> bool {
        self.width == 0 || self.height == 0
    }

    /// Whether pixel (x, y) lies in it.
    #[must_use]
    pub const fn contains(self, x: i32, y: i32) -> bool {
        self.x <= x && x < self.right() && self.y <= y && y < self.bottom()
    }

    /// The pixels that lie in both.
    #[must_use]
    pub fn intersection(self, other: Self) -> Self {
        Self::from_edges(
            self.x.max(other.x),
            self.y.max(other.y),
            self.right().min(other.right()),
            self.bottom().min(other.bottom()),
        )
    }

    /// The smallest rectangle that holds both, of which none is empty.
    #[must_use]
    pub(crate) fn union(self, other: Self) -> Self {
        Self::from_edges(
            self.x.min(other.x),
            self.y.min(other.y),
            self.right().max(other.right()),
            self.bottom().max(other.bottom()),
        )
    }
}

/// Every pixel that can be drawn to: see [`EXTENT`].
pub(crate) const DOMAIN: Rect =
    Rect { x: -EXTENT, y: -EXTENT, width: 2 * EXTENT as u32, height: 2 * EXTENT as u32 };

/// Some neighbouring pixels of one row, lent by a [`Framebuffer`]: the same number of colours and of depths.
#[derive(Debug)]
pub struct Run<'a, C, D> {
    /// The colours, left to right.
    pub color: &'a mut [C],
    /// The depths, left to right.
    pub depth: &'a mut [D],
}

/// A rectangle of pixels, lent by a [`Framebuffer`] as one slice: row after row, each as far from the one above.
///
/// # Examples
/// A [`Surface`] lends blocks. One of your own with its rows one after the other can, too:
/// ```
/// use halfplane::{Block, Framebuffer, Rect, Run};
///
/// /// 256 × 64 pixels.
/// struct Mine {
///     color: Vec<u32>,
///     depth: Vec<f32>,
/// }
///
/// impl Framebuffer for Mine {
///     type Color = u32;
///     type Depth = f32;
///
///     fn area(&self) -> Rect {
///         Rect::of_size(256, 64)
///     }
///
///     fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, u32, f32> {
///         let start = y as usize * 256 + x as usize;
///         Run { color: &mut self.color[start..start + len], depth: &mut self.depth[start..start + len] }
///     }
///
///     fn block(&mut self, x: i32, y: i32, width: usize, height: usize) -> Option<Block<'_, u32, f32>> {
///         let start = y as usize * 256 + x as usize;
///         let end = start + (height - 1) * 256 + width;
///         Some(Block { color: &mut self.color[start..end], depth: &mut self.depth[start..end], stride: 256 })
///     }
/// }
/// ```
#[derive(Debug)]
pub struct Block<'a, C, D> {
    /// The colours, from the first of the top row to the last of the bottom row: (height − 1) · stride + width. Those to the
    /// right of the rectangle, in every row but the last, are not touched.
    pub color: &'a mut [C],
    /// The depths, likewise.
    pub depth: &'a mut [D],
    /// How many elements after a pixel the one below it stands, of colours as of depths: at least the width.
    pub stride: usize,
}

/// What is known of the depths of one row, lent by a [`Framebuffer`]: bounds of depths, not a triangle's bounding box. Draws read them,
/// and write them.
///
/// # Examples
/// [`CoarseDepth`](crate::CoarseDepth) puts them beside any framebuffer. One of your own may keep them itself:
/// ```
/// use halfplane::{Bounds, Framebuffer, Rect, Run};
///
/// /// 256 × 64 pixels: four bounds a row.
/// struct Mine {
///     color: Vec<u32>,
///     depth: Vec<f32>,
///     bounds: Vec<f32>,
/// }
///
/// impl Framebuffer for Mine {
///     type Color = u32;
///     type Depth = f32;
///
///     fn area(&self) -> Rect {
///         Rect::of_size(256, 64)
///     }
///
///     fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, u32, f32> {
///         let start = y as usize * 256 + x as usize;
///         Run { color: &mut self.color[start..start + len], depth: &mut self.depth[start..start + len] }
///     }
///
///     fn bounds(&mut self, y: i32) -> Option<Bounds<'_, f32>> {
///         let start = y as usize * 4;
///         Some(Bounds { segments: &mut self.bounds[start..start + 4], are_upper: true })
///     }
/// }
/// ```
#[derive(Debug)]
pub struct Bounds<'a, D> {
    /// A bound for each 64 pixels, from the left border of the framebuffer's area on. Four at a time are used: a number that
    /// is a multiple of four, enough for the whole row; what is missing does no harm but that nothing is known there.
    ///
    /// The farthest depth, `from_depth(1.0)` of upper bounds and `from_depth(0.0)` of lower ones, says nothing: so they
    /// start. Of any other, no depth of these 64 lies behind it.
    pub segments: &'a mut [D],
    /// Whether they are upper bounds, as suits draws with [`Less`](crate::Less): what lies behind is greater. Or lower ones,
    /// as suits [`Greater`](crate::Greater). The same for all rows.
    pub are_upper: bool,
}

/// Memory for a picture.
///
/// **Law**: for every run inside [`area`](Self::area), [`run`](Self::run) lends slices that are exactly `len` long, the
/// same memory for the same pixel, and other memory for every other: several rows are read before any of them is written.
/// (Of shorter slices, some pixels or none are drawn; nothing panics.) The same holds for [`block`](Self::block) and
/// [`bounds`](Self::bounds), if it lends any. A framebuffer around another should lend what that one does; bounds it must,
/// and have its area.
///
/// Pixels of 1, 2 or 4 bytes shade fastest. A SIMD type such as glam's `Vec4` as colour or as varying keeps the compiler
/// from putting several pixels into one register.
///
/// [`Surface`] is the ready-made one. An implementation of one's own needs no more than this:
///
/// # Examples
/// ```
/// use halfplane::{Framebuffer, Rect, Run};
///
/// /// A grey 8 × 8 display without depth, two fields apart in memory.
/// struct Interlaced {
///     even: [[u8; 8]; 4],
///     odd: [[u8; 8]; 4],
///     no_depth: [(); 8],
/// }
///
/// impl Framebuffer for Interlaced {
///     type Color = u8;
///     type Depth = ();
///
///     fn area(&self) -> Rect {
///         Rect::of_size(8, 8)
///     }
///
///     fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, u8, ()> {
///         let field = if y % 2 == 0 { &mut self.even } else { &mut self.odd };
///         let x = x as usize;
///         Run { color: &mut field[y as usize / 2][x..x + len], depth: &mut self.no_depth[..len] }
///     }
/// }
/// ```
pub trait Framebuffer {
    /// What a pixel holds: any `Copy` type, and `()` for none.
    type Color: Copy;
    /// What the depth buffer holds, and `()` for no depth buffer.
    type Depth: DepthFormat;

    /// The pixels that it has, in the frame's coordinates.
    fn area(&self) -> Rect;

    /// Lends pixels `x .. x + len` of row `y`, which lie inside [`area`](Self::area).
    fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, Self::Color, Self::Depth>;

    /// Lends a rectangle of pixels, at least one wide and high, which lies inside [`area`](Self::area): columns
    /// `x .. x + width` of rows `y .. y + height`, the same memory as [`run`](Self::run)'s. `None`, for all of them, if rows do
    /// not follow each other in memory, or if those of colours and depths do so at different distances.
    ///
    /// Draws then ask for runs. With blocks, they ask once for all of a small triangle, again to write it, and again for what is
    /// blended or discarded; such a block is up to 16 × 16 pixels and may reach beyond the triangle and the scissor. Of a fine mesh,
    /// blocks are worth a fourth of the instructions (see [how fast](crate::how_fast)). Others are only read: up to 512 × 32 pixels
    /// around some small triangles, here and there, so that memory comes before it is needed; and up to 16 × 32 pixels, to see
    /// whether they hide a triangle.
    #[inline(always)]
    fn block(
        &mut self,
        x: i32,
        y: i32,
        width: usize,
        height: usize,
    ) -> Option<Block<'_, Self::Color, Self::Depth>> {
        let _ = (x, y, width, height);
        None
    }

    /// Lends what it knows of row `y`'s depths. `None`, for all rows, if it keeps no such thing: see
    /// [`CoarseDepth`](crate::CoarseDepth), which does.
    #[inline(always)]
    fn bounds(&mut self, y: i32) -> Option<Bounds<'_, Self::Depth>> {
        let _ = y;
        None
    }
}

impl<F: Framebuffer + ?Sized> Framebuffer for &mut F {
    type Color = F::Color;
    type Depth = F::Depth;

    fn area(&self) -> Rect {
        (**self).area()
    }

    #[inline(always)]
    fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, F::Color, F::Depth> {
        (**self).run(x, y, len)
    }

    #[inline(always)]
    fn block(
        &mut self,
        x: i32,
        y: i32,
        width: usize,
        height: usize,
    ) -> Option<Block<'_, F::Color, F::Depth>> {
        (**self).block(x, y, width, height)
    }

    #[inline(always)]
    fn bounds(&mut self, y: i32) -> Option<Bounds<'_, F::Depth>> {
        (**self).bounds(y)
    }
}

/// A plane of a [`Surface`]: `&mut [T]`, or [`Absent`] for memory that is not there.
pub trait Plane: Sized {
    /// What it holds a pixel.
    type Item: Copy;

    /// How many items it has.
    fn len(&self) -> usize;

    /// Whether it has no item.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Items `start .. start + len`; nothing when they are not all there.
    fn span(&mut self, start: usize, len: usize) -> &mut [Self::Item];

    /// The items before `middle` and the others. Everything comes first when there are fewer.
    fn split(self, middle: usize) -> (Self, Self);
}

impl<T: Copy> Plane for &mut [T] {
    type Item = T;

    #[inline(always)]
    fn len(&self) -> usize {
        (**self).len()
    }

    #[inline(always)]
    fn span(&mut self, start: usize, len: usize) -> &mut [T] {
        start.checked_add(len).and_then(|end| self.get_mut(start..end)).unwrap_or_default()
    }

    fn split(self, middle: usize) -> (Self, Self) {
        let middle = middle.min((*self).len());
        self.split_at_mut_checked(middle).unwrap_or_default()
    }
}

/// The colour or depth plane of a surface that has none. Takes no memory; lends slices of `()` of any length.
#[derive(Clone, Copy)]
pub struct Absent([(); usize::MAX]);

impl Default for Absent {
    fn default() -> Self {
        Self([(); usize::MAX])
    }
}

impl core::fmt::Debug for Absent {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str("Absent")
    }
}

impl Plane for Absent {
    type Item = ();

    fn len(&self) -> usize {
        usize::MAX
    }

    #[inline(always)]
    fn span(&mut self, _: usize, len: usize) -> &mut [()] {
        self.0.get_mut(..len).unwrap_or_default()
    }

    fn split(self, _: usize) -> (Self, Self) {
        (self, self)
    }
}

/// Why a [`Surface`] cannot be made.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum SurfaceError {
    /// The pixels are more than the slice has.
    TooShort {
        /// `"color"`, `"depth"` or `"bounds"`.
        plane: &'static str,
        /// How long the slice is.
        len: usize,
        /// How long it would have to be; `usize::MAX` when that overflows.
        needed: usize,
    },
    /// [Bounds](crate::CoarseDepth) are kept for draws that only ever make depths less, or only ever greater, and this test
    /// is none of either.
    NoDirection {
        /// What they compare, if they say so.
        compare: Option<CompareOp>,
    },
    /// Rows would overlap.
    StrideTooSmall {
        /// The stride, in pixels.
        stride: usize,
        /// The width, in pixels.
        width: u32,
    },
    /// The rectangle reaches out of −16384 .. 16384, where no sample is ever covered.
    OutOfRange {
        /// The rectangle.
        area: Rect,
    },
}

impl core::fmt::Display for SurfaceError {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match *self {
            Self::TooShort { plane, len, needed } => {
                write!(f, "the {plane} slice has {len} elements, but the surface needs {needed}")
            }
            Self::NoDirection { compare: Some(compare) } => {
                write!(
                    f,
                    "bounds need a test by Less, LessOrEqual, Greater or GreaterOrEqual, not by {compare:?}"
                )
            }
            Self::NoDirection { compare: None } => {
                write!(f, "bounds need a test that says what it compares")
            }
            Self::StrideTooSmall { stride, width } => {
                write!(f, "a stride of {stride} pixels is less than the width of {width}")
            }
            Self::OutOfRange { area } => write!(
                f,
                "columns {}..{} of rows {}..{} reach out of -{EXTENT}..{EXTENT}",
                area.x,
                area.right(),
                area.y,
                area.bottom()
            ),
        }
    }
}

impl core::error::Error for SurfaceError {}

/// A framebuffer over slices that the caller owns: colour `C`, depth `D`, a rectangle of the frame, and a stride.
///
/// ```text
///   color[0]          color[width − 1]   (padding)      pixel (area.x, area.y) is color[0] and depth[0];
///   color[stride]     …                                 the row below starts `stride` elements later
/// ```
///
/// # Examples
/// ```
/// use halfplane::{Rect, Surface};
/// let mut pixels = [0u32; 64 * 48];
/// let mut depth = [1.0f32; 64 * 48];
/// let frame = Surface::new(&mut pixels, &mut depth, 64, 48)?;
/// // The upper 20 rows and the rest, to be drawn by two threads: both keep the frame's coordinates.
/// let (upper, lower) = frame.split_at_row(20);
/// assert_eq!(lower.area(), Rect { x: 0, y: 20, width: 64, height: 28 });
/// # use halfplane::Framebuffer;
/// # assert_eq!(upper.area().height, 20);
/// # Ok::<(), halfplane::SurfaceError>(())
/// ```
#[derive(Debug)]
pub struct Surface<C, D> {
    color: C,
    depth: D,
    area: Rect,
    stride: usize,
}

impl<'a, C: Copy, D: DepthFormat> Surface<&'a mut [C], &'a mut [D]> {
    /// Colour and depth, rows one after the other, (0, 0) first.
    ///
    /// # Errors
    /// When a slice has fewer than `width * height` elements, or a side is more than 16 384.
    pub fn new(
        color: &'a mut [C],
        depth: &'a mut [D],
        width: u32,
        height: u32,
    ) -> Result<Self, SurfaceError> {
        Self::with_planes(color, depth, Rect::of_size(width, height), width as usize)
    }
}

impl<'a, C: Copy> Surface<&'a mut [C], Absent> {
    /// Colour without a depth buffer: every fragment passes. (For a part of a picture, or padded rows, see
    /// [`with_planes`](Surface::with_planes) with [`Absent`] for the depth.)
    ///
    /// # Errors
    /// As [`Surface::new`].
    pub fn color_only(color: &'a mut [C], width: u32, height: u32) -> Result<Self, SurfaceError> {
        Self::with_planes(color, Absent::default(), Rect::of_size(width, height), width as usize)
    }
}

impl<'a, D: DepthFormat> Surface<Absent, &'a mut [D]> {
    /// Depth without colour, as for a shadow map: draw with a closure that returns `()`.
    ///
    /// # Errors
    /// As [`Surface::new`].
    pub fn depth_only(depth: &'a mut [D], width: u32, height: u32) -> Result<Self, SurfaceError> {
        Self::with_planes(Absent::default(), depth, Rect::of_size(width, height), width as usize)
    }
}

impl<C: Plane, D: Plane<Item: DepthFormat>> Surface<C, D> {
    /// Planes of any kind that hold `area` of a frame, rows `stride` elements apart: a tile, a part of a larger
    /// picture, rows with padding.
    ///
    /// # Errors
    /// When `stride` is less than the width, when a plane ends before the last pixel, or when `area` reaches out of
    /// −16384 .. 16384.
    ///
    /// # Examples
    /// ```
    /// use halfplane::{Rect, Surface};
    /// let mut tile = [0u16; 16 * 16];
    /// let mut depth = [u16::MAX; 16 * 16];
    /// let area = Rect { x: 32, y: 48, width: 16, height: 16 };
    /// let surface = Surface::with_planes(&mut tile[..], &mut depth[..], area, 16)?;
    /// # drop(surface);
    /// # Ok::<(), halfplane::SurfaceError>(())
    /// ```
    pub fn with_planes(color: C, depth: D, area: Rect, stride: usize) -> Result<Self, SurfaceError> {
        if area.intersection(DOMAIN) != area && !area.is_empty() {
            return Err(SurfaceError::OutOfRange { area });
        }
        if stride < area.width as usize {
            return Err(SurfaceError::StrideTooSmall { stride, width: area.width });
        }
        let needed = match (area.is_empty(), (area.height as usize).checked_sub(1)) {
            (true, _) | (_, None) => Some(0),
            (false, Some(rows)) => {
                rows.checked_mul(stride).and_then(|before| before.checked_add(area.width as usize))
            }
        };
        for (plane, len) in [("color", color.len()), ("depth", depth.len())] {
            // What overflows is more than even an absent plane has.
            if needed.is_none_or(|needed| len < needed) {
                return Err(SurfaceError::TooShort { plane, len, needed: needed.unwrap_or(usize::MAX) });
            }
        }
        Ok(Self { color, depth, area, stride })
    }

    /// The pixels that it has, in the frame's coordinates.
    #[must_use]
    pub fn area(&self) -> Rect {
        self.area
    }

    /// The rows above `y` and the others, as two surfaces that share no memory and keep the frame's coordinates.
    /// One of them is empty when `y` lies outside.
    #[must_use]
    pub fn split_at_row(self, y: i32) -> (Self, Self) {
        let Self { color, depth, area, stride } = self;
        let y = y.clamp(area.y, area.bottom());
        let above = Rect { height: y.abs_diff(area.y), ..area };
        let below = Rect { y, height: area.bottom().abs_diff(y), ..area };
        // The last row may end before its stride does, so a split past the end takes what there is.
        let middle = (above.height as usize).saturating_mul(stride);
        let (color_above, color_below) = color.split(middle);
        let (depth_above, depth_below) = depth.split(middle);
        (
            Self { color: color_above, depth: depth_above, area: above, stride },
            Self { color: color_below, depth: depth_below, area: below, stride },
        )
    }

    /// Bands of `rows` rows each, from the top; the last may have fewer. The whole when `rows` is zero.
    ///
    /// ```
    /// # use halfplane::Surface;
    /// let mut pixels = [0u32; 64 * 48];
    /// let frame = Surface::color_only(&mut pixels, 64, 48)?;
    /// let heights: Vec<u32> = frame.bands(20).map(|band| band.area().height).collect();
    /// assert_eq!(heights, [20, 20, 8]);
    /// # Ok::<(), halfplane::SurfaceError>(())
    /// ```
    #[must_use]
    pub fn bands(self, rows: u32) -> Bands<C, D> {
        let rows = if rows == 0 { self.area.height } else { rows };
        Bands { rest: Some(self), rows }
    }
}

impl<C: Plane, D: Plane<Item: DepthFormat>> Framebuffer for Surface<C, D> {
    type Color = C::Item;
    type Depth = D::Item;

    fn area(&self) -> Rect {
        self.area
    }

    #[inline(always)]
    fn run(&mut self, x: i32, y: i32, len: usize) -> Run<'_, C::Item, D::Item> {
        let start = self.place(x, y);
        Run { color: self.color.span(start, len), depth: self.depth.span(start, len) }
    }

    #[inline(always)]
    fn block(&mut self, x: i32, y: i32, width: usize, height: usize) -> Option<Block<'_, C::Item, D::Item>> {
        let (start, stride) = (self.place(x, y), self.stride);
        let len = height.wrapping_sub(1).wrapping_mul(stride).wrapping_add(width);
        Some(Block { color: self.color.span(start, len), depth: self.depth.span(start, len), stride })
    }
}

impl<C, D> Surface<C, D> {
    /// Where a pixel is in memory. Wrapping: one outside of the area is some other pixel or none, but overflows nothing.
    #[inline(always)]
    fn place(&self, x: i32, y: i32) -> usize {
        let (column, row) = (x.wrapping_sub(self.area.x), y.wrapping_sub(self.area.y));
        (row as usize).wrapping_mul(self.stride).wrapping_add(column as usize)
    }
}

/// The bands of a [`Surface`], top to bottom: see [`Surface::bands`].
#[derive(Debug)]
pub struct Bands<C, D> {
    rest: Option<Surface<C, D>>,
    rows: u32,
}

impl<C: Plane, D: Plane<Item: DepthFormat>> Iterator for Bands<C, D> {
    type Item = Surface<C, D>;

    fn next(&mut self) -> Option<Self::Item> {
        let rest = self.rest.take().filter(|rest| !rest.area.is_empty())?;
        let y = rest.area.y.saturating_add_unsigned(self.rows);
        let (band, rest) = rest.split_at_row(y);
        self.rest = Some(rest);
        Some(band)
    }
}

/// A block, cut so that colours and depths are as many, if it is as long as it should be. (Places in it are
/// numbers of 32 bits.)
#[inline(always)]
pub(crate) fn lend<F: Framebuffer>(
    target: &mut F,
    (x, y): (i32, i32),
    (width, height): (usize, usize),
) -> Option<Block<'_, F::Color, F::Depth>> {
    let Block { color, depth, stride } = target.block(x, y, width, height)?;
    let len = color.len().min(depth.len());
    let needed = (height - 1).wrapping_mul(stride).wrapping_add(width);
    if needed > len || stride > u32::MAX as usize / 32 {
        return None;
    }
    Some(Block { color: color.get_mut(..len)?, depth: depth.get_mut(..len)?, stride })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rectangles_at_the_ends_of_i32_do_not_overflow() {
        let huge = Rect { x: i32::MIN, y: i32::MIN, width: u32::MAX, height: u32::MAX };
        assert_eq!(huge.right(), i32::MAX, "i32::MIN + u32::MAX");
        assert_eq!(huge.intersection(DOMAIN), DOMAIN, "everything");
        let far = Rect { x: i32::MAX, y: 0, width: u32::MAX, height: 1 };
        assert!(far.intersection(DOMAIN).is_empty(), "nothing");
    }

    #[test]
    fn a_run_is_the_pixels_that_were_asked_for() {
        let mut pixels: [u32; 20] = core::array::from_fn(|i| u32::try_from(i).expect("small"));
        let area = Rect { x: 10, y: 5, width: 3, height: 4 };
        let mut surface = Surface::with_planes(&mut pixels[..], Absent::default(), area, 5).expect("fits");
        assert_eq!(surface.run(11, 7, 2).color, [11, 12], "row 2 starts at 10");
        let (_, mut below) = surface.split_at_row(7);
        assert_eq!(below.run(10, 8, 3).color, [15, 16, 17], "global coordinates survive a split");
    }

    #[test]
    fn a_plane_that_is_split_behind_its_end_comes_first() {
        for (middle, lens) in [(0, (0, 3)), (2, (2, 1)), (3, (3, 0)), (4, (3, 0)), (usize::MAX, (3, 0))] {
            let mut items = [1u8, 2, 3];
            let (first, second) = Plane::split(&mut items[..], middle);
            assert_eq!((first.len(), second.len()), lens, "{middle}");
        }
    }

    #[test]
    fn what_does_not_fit_is_refused_with_numbers() {
        let mut pixels = [0u8; 12];
        let error = Surface::color_only(&mut pixels, 4, 4).expect_err("12 < 16");
        assert_eq!(error, SurfaceError::TooShort { plane: "color", len: 12, needed: 16 }, "numbers");
        let area = Rect { x: 16_383, y: 0, width: 2, height: 1 };
        let error =
            Surface::with_planes(&mut pixels[..], Absent::default(), area, 2).expect_err("x = 16 384");
        assert_eq!(error, SurfaceError::OutOfRange { area }, "out of range");
        let area = Rect { x: 0, y: 0, width: 3, height: 4 };
        let error = Surface::with_planes(&mut pixels[..], Absent::default(), area, 2).expect_err("2 < 3");
        assert_eq!(error, SurfaceError::StrideTooSmall { stride: 2, width: 3 }, "stride");
        assert!(Surface::color_only(&mut pixels, 0, 5).is_ok(), "an empty surface needs nothing");
    }
}
