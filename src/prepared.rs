//! Prepared geometry: the two halves of a draw apart, with memory of the caller's between them.
//!
//! The geometry half fills [`Record`]s, one for each triangle that may be seen. The fragment half draws records into any
//! framebuffer: the whole frame, a band, a tile; any number of times, from any thread, with the same bits as a draw
//! that does both at once. So a frame that is cut into many tiles pays for its geometry once.
//!
//! ```text
//!   positions ─► clip ─► project ─► cull ─► Record … Record ─► traverse ─► depth ─► your closure ─► tile
//!                                           (your memory)  └─► traverse ─► depth ─► your closure ─► tile
//! ```
//!
//! A triangle that has to be clipped is *one* record too. What clipping leaves of it is up to eight triangles, each with
//! 72 bytes of history for the sake of its weights; but its three positions in clip space take just the room of three
//! projected vertices, and they are kept instead. Such a triangle is clipped again for each tile that it is drawn into:
//! few triangles are ever clipped, and all records would be that much larger.

use core::fmt;

use glam::Vec4;

use crate::behind::{Sight, keep_seen};
use crate::closure::{Shade, Whole};
use crate::depth::DepthTest;
use crate::fan::{Fan, History, Piece, at_corners};
use crate::fragment::{Fragment, Identity};
use crate::geometry::Geometry;
use crate::interpolate::Varyings;
use crate::primitive::{Index, Primitives};
use crate::project::{Positions, ProjectedVertex, Projector};
use crate::queue::Queue;
use crate::rasterizer::{DrawError, Rasterizer, Source, checked_triangles};
use crate::setup::{Setup, sample_bounds};
use crate::sieve::BATCH;
use crate::state::Statistics;
use crate::target::{Borders, Framebuffer, Rect};
use crate::tiny::Outline;
use crate::triple::each;
use crate::vertex::Attributes;

/// One triangle, ready to be drawn into any part of a frame: plain data, made by [`Preparation::fill`].
///
/// * **Size**: 56 bytes and three values of `V`, rounded up to the alignment: 80 bytes for `Vec2`, 116 for a `Vec3` and
///   a `Vec2`.
/// * A triangle makes one record or none, so as many records as triangles are always enough.
/// * It borrows nothing, and knows its triangle's number.
///
/// ```
/// # use glam::{Vec2, Vec3};
/// # use halfplane::Record;
/// assert_eq!(size_of::<Record<()>>(), 56);
/// assert_eq!(size_of::<Record<Vec2>>(), 80);
/// assert_eq!(size_of::<Record<(Vec3, Vec2)>>(), 116);
/// ```
#[derive(Clone, Copy)]
pub struct Record<V> {
    /// The corners in canonical order on the subpixel grid; or the vertices in clip space.
    words: [[u32; 4]; 3],
    primitive: u32,
    kind: Kind,
    /// The corners' order, as a place in [`ORDERS`](crate::setup::ORDERS); or which planes the vertices lie outside of.
    detail: u8,
    provoking: u8,
    is_front_facing: bool,
    /// At the corners; or at the caller's vertices.
    varyings: [V; 3],
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Nothing was ever written here.
    Blank,
    Whole,
    /// To be clipped when it is drawn.
    Clipped,
}

impl<V: Copy> Record<V> {
    /// A record that draws nothing: what to fill memory with before there is anything else. The value does not matter.
    ///
    /// ```
    /// use halfplane::{Record, glam::Vec2};
    /// let records = [Record::blank(Vec2::ZERO); 64]; // also in a `static`
    /// # drop(records);
    /// ```
    #[must_use]
    pub const fn blank(value: V) -> Self {
        Self {
            words: [[0; 4]; 3],
            primitive: 0,
            kind: Kind::Blank,
            detail: 0,
            provoking: 0,
            is_front_facing: false,
            varyings: [value; 3],
        }
    }

    /// The number of its triangle in the draw, counted from 0.
    #[must_use]
    pub fn primitive_index(&self) -> u32 {
        self.primitive
    }

    /// Of a whole triangle, in canonical order.
    #[inline(always)]
    fn corners(&self) -> Option<[ProjectedVertex; 3]> {
        (self.kind == Kind::Whole).then(|| each(self.words, ProjectedVertex::from_words))
    }

    /// The pixels whose samples lie in its bounding box: left, top, right, bottom. `None` where [`setup`](Self::setup) is.
    #[inline(always)]
    pub(crate) fn bounds(&self) -> Option<Borders> {
        self.corners().map(|[a, b, c]| sample_bounds(a, b, c))
    }

    /// Its geometry. `None` of a triangle that is clipped when it is drawn, and of a blank record.
    #[inline(always)]
    #[must_use]
    pub fn setup(&self) -> Option<Setup> {
        self.corners().map(|corners| Setup::of_corners(corners, self.detail))
    }

    #[inline(always)]
    fn of_piece(piece: &Piece, identity: Identity, varyings: [V; 3]) -> Self {
        let setup = piece.setup;
        let Identity { provoking, is_front_facing, primitive } = identity;
        Self {
            words: each(setup.corners(), ProjectedVertex::to_words),
            primitive,
            kind: Kind::Whole,
            detail: setup.place(),
            provoking,
            is_front_facing,
            varyings,
        }
    }

    #[cold]
    fn of_fan(fan: &Fan, identity: Identity, varyings: [V; 3]) -> Self {
        let (positions, outcodes) = fan.origin();
        let Identity { provoking, is_front_facing, primitive } = identity;
        Self {
            words: each(positions, |position| position.to_array().map(f32::to_bits)),
            primitive,
            kind: Kind::Clipped,
            detail: outcodes,
            provoking,
            is_front_facing,
            varyings,
        }
    }

    #[inline(always)]
    fn identity(&self) -> Identity {
        let Self { provoking, is_front_facing, primitive, .. } = *self;
        Identity { provoking, is_front_facing, primitive }
    }

    /// What clipping leaves of it.
    #[cold]
    #[inline(never)]
    fn fan(&self, projector: &Projector) -> Fan {
        let positions = each(self.words, |words| Vec4::from_array(words.map(f32::from_bits)));
        Fan::new([0; 3], positions, self.detail, self.primitive, projector)
    }

    /// Calls `visit` with each triangle that it consists of.
    pub(crate) fn for_each_setup(&self, projector: Projector, mut visit: impl FnMut(&Setup)) {
        match self.setup() {
            Some(setup) => visit(&setup),
            None if self.kind == Kind::Clipped => {
                let mut fan = self.fan(&projector);
                while let Some(piece) = fan.next(&projector) {
                    visit(&piece.setup);
                }
            }
            None => {}
        }
    }
}

/// [`Record::blank`] of the default value.
impl<V: Copy + Default> Default for Record<V> {
    fn default() -> Self {
        Self::blank(V::default())
    }
}

impl<V> fmt::Debug for Record<V> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Record")
            .field("primitive", &self.primitive)
            .field("kind", &self.kind)
            .finish_non_exhaustive()
    }
}

/// The geometry half of a draw, on its way into records: see [`Rasterizer::prepare`].
#[derive(Debug)]
pub struct Preparation<'a, I, P, A> {
    geometry: Geometry<'a, I, P>,
    varyings: A,
}

impl<I: Index, P: Positions, A: Attributes> Preparation<'_, I, P, A> {
    /// Prepares the next triangles, as many as there is room for, in the order of submission.
    ///
    /// Fewer records than there was room for are the last ones; `None` says that there were no more. As the memory may be
    /// too small for all triangles, and may hold a single one, call this until it says so:
    ///
    /// ```
    /// # use halfplane::{DrawError, Primitives, Rasterizer, Record, Rect, Viewport, glam::Vec4};
    /// # let rasterizer = Rasterizer::<()>::new(Viewport::of_size(64, 64).unwrap());
    /// # let positions = [(-1.0, -1.0), (1.0, -1.0), (0.0, 1.0)].map(|(x, y)| Vec4::new(x, y, 0.5, 1.0)).repeat(5);
    /// let mut records = [Record::default(); 2];
    /// let mut preparation = rasterizer.prepare(Rect::of_size(64, 64), Primitives::list(), &positions[..], ())?;
    /// let mut batches = Vec::new();
    /// while let Some(batch) = preparation.fill(&mut records)? {
    ///     batches.push(batch.len()); // and draw it
    /// }
    /// assert_eq!(batches, [2, 2, 1]);
    /// assert_eq!(preparation.statistics().primitives, 5);
    /// # Ok::<(), DrawError>(())
    /// ```
    ///
    /// # Errors
    /// When there is no room for any record.
    #[inline(always)]
    pub fn fill<'r>(
        &mut self,
        records: &'r mut [Record<A::Value>],
    ) -> Result<Option<&'r [Record<A::Value>]>, DrawError> {
        if records.is_empty() {
            return Err(DrawError::NoRecords);
        }
        let mut count = 0;
        for record in records.iter_mut() {
            let Some(next) = self.next() else { break };
            *record = next;
            count += 1;
        }
        Ok(records.get(..count).filter(|batch| !batch.is_empty()))
    }

    #[inline(always)]
    fn next(&mut self) -> Option<Record<A::Value>> {
        loop {
            let mut fan = None;
            let Some(piece) = self.geometry.next(&mut fan) else {
                if !self.geometry.refill() {
                    return None;
                }
                continue;
            };
            let values = each(piece.vertices, |index| self.varyings.fetch(index));
            let [Some(a), Some(b), Some(c)] = values else { continue };
            // Of a clipped triangle, the first piece that may be seen stands for all: the rest of the fan is dropped.
            let identity = self.geometry.identity(&piece);
            return Some(match fan {
                None => Record::of_piece(&piece, identity, [a, b, c]),
                Some(fan) => Record::of_fan(&fan, identity, [a, b, c]),
            });
        }
    }

    /// What became of the triangles so far; after the last [`fill`](Self::fill), of all. Its fragments are zero.
    ///
    /// Triangles are looked at some dozens at a time, so it may count some that are still to come.
    #[must_use]
    pub fn statistics(&self) -> Statistics {
        self.geometry.statistics
    }
}

/// Records, to be drawn.
struct Records<'r, R, V> {
    records: R,
    /// Some that may touch the area, in order, and which of them did not come yet and were not left out.
    batch: [Option<&'r Record<V>>; BATCH],
    queue: Queue,
    /// Where in the batch the one that came last stands.
    place: usize,
    /// The one that is drawn, and whether a piece of it is.
    record: Option<&'r Record<V>>,
    is_piece: bool,
    projector: Projector,
    /// The render area.
    area: Borders,
    /// What is left of a clipped one.
    fan: Option<Fan>,
    /// The values at the corners of the piece that is drawn, if it is one of a clipped triangle.
    values: Option<[V; 3]>,
}

impl<'r, V: Varyings, R: Iterator<Item = &'r Record<V>>> Source<V> for Records<'r, R, V> {
    #[inline(always)]
    fn refill(&mut self) -> bool {
        let mut count = 0;
        while count < BATCH {
            let Some(record) = self.records.next() else { break };
            if record.bounds().map_or(record.kind == Kind::Clipped, |bounds| bounds.overlaps(self.area)) {
                self.batch[count] = Some(record);
                count += 1;
            }
        }
        self.queue = Queue::below(count);
        count > 0
    }

    #[inline(always)]
    fn leave_out(&mut self, mut look: impl FnMut([ProjectedVertex; 3], Borders) -> Sight) {
        keep_seen(
            &mut self.queue,
            #[cfg_attr(feature = "dispatch", inline(always))]
            |place| {
                let Some(record) = self.batch.get(place).copied().flatten() else { return Sight::Unknown };
                let Some(corners @ [a, b, c]) = record.corners() else { return Sight::Unknown };
                look(corners, sample_bounds(a, b, c))
            },
        );
    }

    #[inline(always)]
    fn neighbourhood(&self) -> Option<Borders> {
        // A tile's pixels are near already.
        None
    }

    #[inline(always)]
    fn next(&mut self) -> Option<Piece> {
        loop {
            if let Some(fan) = &mut self.fan {
                let Some(piece) = fan.next(&self.projector) else {
                    self.fan = None;
                    continue;
                };
                let [a, b, c] = piece.setup.corners();
                if sample_bounds(a, b, c).overlaps(self.area) {
                    return Some(Piece { vertices: [self.place; 3], ..piece });
                }
                continue;
            }
            self.place = self.queue.pop()?;
            let record = (*self.batch.get(self.place)?)?;
            if let Some(setup) = record.setup() {
                let (vertices, primitive) = ([self.place; 3], record.primitive);
                return Some(Piece { setup, vertices, primitive, in_fan: 0, covered: 0 });
            }
            self.fan = Some(record.fan(&self.projector));
        }
    }

    #[inline(always)]
    fn history(&self, piece: &Piece) -> Option<History> {
        self.fan.as_ref()?.history(piece.in_fan)
    }

    #[inline(always)]
    fn outline(&self, piece: &Piece) -> Outline {
        Outline::new(&piece.setup)
    }

    #[inline(always)]
    fn fetch(&mut self, piece: &Piece, history: Option<&History>) -> Option<()> {
        let record = (*self.batch.get(piece.vertices[0])?)?;
        self.record = Some(record);
        self.is_piece = history.is_some();
        if let Some(history) = history {
            let values = record.varyings;
            self.values = Some(at_corners(piece.setup.order(), record.provoking, values, history));
        }
        Some(())
    }

    #[inline(always)]
    fn identity(&self, piece: &Piece) -> Option<Identity> {
        self.batch.get(piece.vertices[0])?.map(Record::identity)
    }

    #[inline(always)]
    fn varyings(&self) -> Option<&[V; 3]> {
        if self.is_piece { self.values.as_ref() } else { self.record.map(|record| &record.varyings) }
    }
}

impl<V: Varyings, T: DepthTest> Rasterizer<V, T> {
    /// Begins the geometry half of a draw: the result [fills](Preparation::fill) records.
    ///
    /// * `area`: the pixels of the whole frame. Triangles that cannot be seen there make no record.
    /// * `positions`, `varyings`: as in [`draw`](Rasterizer::draw).
    ///
    /// Several threads can prepare [parts](Primitives::part) of the primitives at a time; the parts' records one part
    /// after the other draw what those of the whole draw. (They may be more: a triangle in the size of a pixel that lies
    /// between samples makes no record where there are many such triangles to look for.)
    ///
    /// # Errors
    /// As [`draw`](Rasterizer::draw).
    ///
    /// # Examples
    /// A frame in four tiles that never exist at a time, in memory for one of them:
    /// ```
    /// use glam::{Vec3, Vec4};
    /// use halfplane::{Primitives, Rasterizer, Record, Rect, Surface, Viewport, pack_rgba8};
    ///
    /// let rasterizer = Rasterizer::<Vec3>::new(Viewport::of_size(64, 64)?);
    /// let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
    /// let colors = [Vec3::X, Vec3::Y, Vec3::Z];
    ///
    /// let mut records = [Record::default(); 16];
    /// let mut preparation = rasterizer.prepare(Rect::of_size(64, 64), Primitives::list(), &positions, &colors)?;
    /// let batch = preparation.fill(&mut records)?.unwrap_or_default();
    /// assert_eq!(batch.len(), 1);
    ///
    /// let mut samples = 0;
    /// for (x, y) in [(0, 0), (32, 0), (0, 32), (32, 32)] {
    ///     let (mut pixels, mut depth) = ([0u32; 32 * 32], [1.0f32; 32 * 32]);
    ///     let area = Rect { x, y, width: 32, height: 32 };
    ///     let mut tile = Surface::with_planes(&mut pixels[..], &mut depth[..], area, 32)?;
    ///     let statistics = rasterizer.draw_prepared(&mut tile, batch, |fragment| {
    ///         pack_rgba8(fragment.varyings().extend(1.0))
    ///     });
    ///     samples += statistics.samples_passed; // and send the pixels somewhere
    /// }
    /// assert_eq!(samples, 64 * 64 / 2);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[inline(always)]
    pub fn prepare<'a, I, P, A>(
        &self,
        area: Rect,
        primitives: Primitives<'a, I>,
        positions: P,
        varyings: A,
    ) -> Result<Preparation<'a, I, P, A>, DrawError>
    where
        I: Index,
        P: Positions,
        A: Attributes<Value = V>,
    {
        // The scissor is that of each draw.
        let area = self.viewport.pixels().intersection(area);
        let triangles = checked_triangles(primitives, &positions, &varyings)?;
        let geometry = self.geometry(triangles, positions, area);
        Ok(Preparation { geometry, varyings })
    }

    /// The fragment half of a draw: as [`draw`](Rasterizer::draw), from records that this rasterizer prepared.
    ///
    /// Records are drawn in the order given; some dozens are taken from the iterator before the first of them is drawn. Those
    /// that lie beside the target are skipped; of very many, let [bins](Rasterizer::bin) find those that do not. The statistics
    /// count fragments, and no primitives.
    ///
    /// The viewport, clip depth and depth clip must be those that the records were prepared with. Everything else may
    /// differ: scissor, depth bias, depth test. (Culling, front face and provoking vertex were decided by
    /// [`prepare`](Self::prepare), which does not look at the scissor.)
    ///
    /// # Examples
    /// See [`prepare`](Self::prepare).
    #[inline(always)]
    pub fn draw_prepared<'r, F, S, R>(
        &self,
        target: &mut F,
        records: impl IntoIterator<Item = &'r Record<V>>,
        mut shade: S,
    ) -> Statistics
    where
        V: 'r,
        F: Framebuffer,
        S: FnMut(Fragment<'_, V>) -> R,
        R: Into<Option<F::Color>>,
    {
        let shade = move |fragment: Fragment<'_, V>, _| shade(fragment);
        self.draw_prepared_with::<_, _, false>(target, records, Whole(shade))
    }

    /// The fragment half of [`draw_over`](Rasterizer::draw_over): the closure is also lent the colour already there. All else is as
    /// in [`draw_prepared`](Self::draw_prepared).
    ///
    /// # Examples
    /// ```
    /// # use glam::Vec4;
    /// # use halfplane::{Primitives, Rasterizer, Record, Rect, Surface, Viewport};
    /// # let positions = [Vec4::new(-1.0, -1.0, 0.5, 1.0), Vec4::new(1.0, -1.0, 0.5, 1.0), Vec4::new(0.0, 1.0, 0.5, 1.0)];
    /// # let rasterizer = Rasterizer::<()>::new(Viewport::of_size(64, 64)?);
    /// let mut records = [Record::default(); 4];
    /// let mut preparation = rasterizer.prepare(Rect::of_size(64, 64), Primitives::list(), &positions, ())?;
    /// let batch = preparation.fill(&mut records)?.unwrap_or_default();
    ///
    /// let mut counts = [0u8; 64 * 64];
    /// let mut target = Surface::color_only(&mut counts, 64, 64)?;
    /// for _ in 0..3 {
    ///     rasterizer.draw_prepared_over(&mut target, batch, |_, count| count + 1);
    /// }
    /// assert_eq!(counts.iter().map(|&count| u32::from(count)).sum::<u32>(), 3 * 64 * 64 / 2);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    #[inline(always)]
    pub fn draw_prepared_over<'r, F, S, R>(
        &self,
        target: &mut F,
        records: impl IntoIterator<Item = &'r Record<V>>,
        shade: S,
    ) -> Statistics
    where
        V: 'r,
        F: Framebuffer,
        S: FnMut(Fragment<'_, V>, F::Color) -> R,
        R: Into<Option<F::Color>>,
    {
        self.draw_prepared_with::<_, _, true>(target, records, Whole(shade))
    }

    /// The fragment half of a draw with a closure that reads the colour already there if it `BLENDS`.
    #[inline(always)]
    pub(crate) fn draw_prepared_with<'r, F, S, const BLENDS: bool>(
        &self,
        target: &mut F,
        records: impl IntoIterator<Item = &'r Record<V>>,
        closure: S,
    ) -> Statistics
    where
        V: 'r,
        F: Framebuffer,
        S: Shade<V, F::Color>,
    {
        let (projector, area) = (self.projector(), self.render_area(target));
        // Fused: it is asked again after the last batch.
        let (records, area) = (records.into_iter().fuse(), area.borders());
        let mut source = Records {
            records,
            batch: [None; BATCH],
            queue: Queue::EMPTY,
            place: 0,
            record: None,
            is_piece: false,
            projector,
            area,
            fan: None,
            values: None,
        };
        self.draw_triangles::<_, _, BLENDS>(target, &mut source, closure)
    }
}
