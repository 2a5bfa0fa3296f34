//! What clipping leaves of a triangle: a convex polygon, drawn as a fan of triangles.
//!
//! A piece of a fan is a triangle like any other, except that its corners have a history: their weights over the three
//! vertices that the caller knows.

use glam::Vec4;

use crate::clip::{Corner, Room, room_of, turn};
use crate::fragment::{Pedigree, reorder};
use crate::interpolate::{Varyings, Weights};
use crate::project::{ProjectedVertex, Projector};
use crate::setup::{Setup, signed_area2};
use crate::triple::each;

/// A triangle, or a piece of one that was clipped, which may cover samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) setup: Setup,
    /// The caller's vertices: of a whole triangle in canonical order, of a clipped one as the caller named them;
    /// of a record, where it stands in the batch.
    pub(crate) vertices: [usize; 3],
    /// The triangle's number. (Of records nobody asks for it here: they know who they are.)
    pub(crate) primitive: u32,
    /// Which piece of a [`Fan`] it is: corners 0, this and the next one. Zero for a whole triangle.
    pub(crate) in_fan: usize,
    /// Which samples of a *minute* triangle are covered, whose bounds hold two by two at the most: the lowest bit is the
    /// one at the top left, the next its right neighbour, then those below. All of them lie in the render area. 0 if it is
    /// not known: of larger ones, at the area's border, where few triangles are minute, of pieces of clipped ones, of
    /// records, and where there is no SIMD. (As large as `primitive`, so that no padding is copied.)
    pub(crate) covered: u32,
}

impl Piece {
    /// None at all.
    pub(crate) const BLANK: Self =
        Self { setup: Setup::BLANK, vertices: [0; 3], primitive: 0, in_fan: 0, covered: 0 };
}

/// The corners of a piece of a polygon.
pub(crate) fn piece_of(polygon: &[Corner], piece: usize) -> Option<[&Corner; 3]> {
    Some([polygon.first()?, polygon.get(piece)?, polygon.get(piece + 1)?])
}

/// Puts them on the subpixel grid. Gives twice the signed area.
#[inline(never)]
pub(crate) fn project_piece(
    polygon: &[Corner],
    piece: usize,
    projector: &Projector,
    projected: &mut [ProjectedVertex; 3],
) -> Option<i64> {
    for (vertex, &corner) in projected.iter_mut().zip(&[0, piece, piece + 1]) {
        *vertex = projector.project_clipped(&polygon.get(corner)?.position);
    }
    let [a, b, c] = *projected;
    Some(signed_area2(a, b, c))
}

/// Turns a polygon until no piece of its fan is turned over. Gives twice its signed area on the subpixel grid. What it
/// leaves in `projected` means nothing.
///
/// Rounding may bend a sliver's polygon. In a fan from a corner next to the one that is bent inwards, a piece is turned
/// over, and those beside it lie upon one another or reach out of the polygon. Where rounding makes the polygon cross
/// itself, or bends it twice, there may be no right corner: it stays as it was.
#[inline(always)]
pub(crate) fn settle(
    polygon: &mut [Corner],
    projector: &Projector,
    projected: &mut [ProjectedVertex; 3],
) -> i64 {
    let mut turns = 0;
    loop {
        let (mut area2, mut has_front, mut has_back, mut piece) = (0, false, false, 1);
        while let Some(of_piece) = project_piece(polygon, piece, projector, projected) {
            area2 += of_piece;
            has_front |= of_piece < 0;
            has_back |= of_piece > 0;
            piece += 1;
        }
        // Nothing is turned over, or it has come round.
        if !(has_front & has_back) || turns == polygon.len() {
            return area2;
        }
        turns += 1;
        turn(polygon);
    }
}

/// Where a piece's corners come from.
#[derive(Clone, Copy, Debug)]
pub(crate) struct History {
    /// Each one's perspective weights over the caller's vertices.
    pub(crate) weights: [[f32; 3]; 3],
    /// The w of those.
    pub(crate) w: [f32; 3],
}

impl History {
    /// Of a triangle that was not clipped.
    pub(crate) const WHOLE: Self =
        Self { weights: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], w: [1.0; 3] };

    /// The screen-linear weights of a corner with these perspective ones.
    #[inline(always)]
    fn barycentrics(&self, [a, b, c]: [f32; 3]) -> [f32; 3] {
        let parts = [a * self.w[0], b * self.w[1], c * self.w[2]];
        let whole = parts[0] + parts[1] + parts[2];
        [parts[0] / whole, parts[1] / whole, parts[2] / whole]
    }

    /// Both kinds of weights.
    #[inline(always)]
    pub(crate) fn pedigree(&self) -> Pedigree {
        Pedigree {
            weights: self.weights,
            barycentrics: each(self.weights, |weights| self.barycentrics(weights)),
        }
    }

    /// The values at the corners, from those at the vertices.
    #[cold]
    #[inline(never)]
    pub(crate) fn interpolate<V: Varyings>(&self, values: &[V; 3], provoking: u8) -> [V; 3] {
        each(self.weights, |weights| {
            V::interpolate(values, &Weights::new(weights, self.barycentrics(weights), provoking))
        })
    }
}

/// The values at the corners of a piece of a clipped triangle, from those at the caller's vertices. (It gets no more of the
/// piece than it needs: a reference to that would keep all of it in memory.)
#[cold]
pub(crate) fn at_corners<V: Varyings>(
    order: [u8; 3],
    provoking: u8,
    values: [V; 3],
    history: &History,
) -> [V; 3] {
    reorder(history.interpolate(&values, provoking), order)
}

/// What clipping leaves of a triangle, as a fan of triangles.
#[derive(Debug)]
pub(crate) struct Fan {
    /// The caller's vertices (of a record, none), their positions with depth in 0 ≤ z ≤ w, and which planes they lie outside of.
    vertices: [usize; 3],
    positions: [Vec4; 3],
    outcodes: u8,
    /// The polygon, as many as `len`.
    corners: Room,
    len: usize,
    /// The triangle's number.
    pub(crate) primitive: u32,
    /// Twice the signed area of all of it.
    area2: i64,
    /// The next piece.
    next: usize,
}

impl Fan {
    #[inline(always)]
    pub(crate) fn new(
        vertices: [usize; 3],
        positions: [Vec4; 3],
        outcodes: u8,
        primitive: u32,
        projector: &Projector,
    ) -> Self {
        let corners = room_of(positions);
        let mut fan = Self { vertices, positions, outcodes, corners, len: 3, primitive, area2: 0, next: 1 };
        fan.len = projector.volume.clip(&mut fan.corners, outcodes);
        let polygon = fan.corners.get_mut(..fan.len).unwrap_or_default();
        fan.area2 = settle(polygon, projector, &mut [ProjectedVertex::BLANK; 3]);
        fan
    }

    fn polygon(&self) -> &[Corner] {
        self.corners.get(..self.len).unwrap_or_default()
    }

    /// What it was made of: positions, and which planes they lie outside of.
    pub(crate) fn origin(&self) -> ([Vec4; 3], u8) {
        (self.positions, self.outcodes)
    }

    /// Whether clipping leaves nothing.
    pub(crate) fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Twice the signed area of all of it, as it stands on the subpixel grid.
    pub(crate) fn area2(&self) -> i64 {
        self.area2
    }

    #[inline(never)]
    pub(crate) fn next(&mut self, projector: &Projector) -> Option<Piece> {
        loop {
            let in_fan = self.next;
            let mut corners = [ProjectedVertex::BLANK; 3];
            let area2 = project_piece(self.polygon(), in_fan, projector, &mut corners)?;
            self.next += 1;
            // One that rounding turned over: what it would cover belongs to its neighbours.
            if area2.signum() == self.area2.signum() {
                let setup = Setup::with_area2(corners, area2);
                return Some(Piece {
                    setup,
                    vertices: self.vertices,
                    primitive: self.primitive,
                    in_fan,
                    covered: 0,
                });
            }
        }
    }

    /// Where a piece's corners come from.
    pub(crate) fn history(&self, piece: usize) -> Option<History> {
        let weights = each(piece_of(self.polygon(), piece)?, |corner| corner.weights);
        Some(History { weights, w: each(self.positions, |position| position.w) })
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use crate::clip::DepthClip;
    use crate::viewport::{ClipDepth, Viewport};
    use std::vec::Vec;

    #[test]
    fn the_pieces_of_a_bent_quad_are_the_quad() {
        let viewport = Viewport::of_size(64, 64).expect("valid");
        let projector = Projector::new(&viewport, ClipDepth::ZeroToOne, DepthClip::Clip);
        let mut random = 1u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (random >> 8) as f32 / 16_777_216.0
        };
        let mut bent = 0;
        for _ in 0..20_000 {
            // Slivers of a few subpixels' height, through the near plane.
            let slope = next() * 2.0 - 1.0;
            let triangle = [(); 3].map(|()| {
                let x = next() * 2.0 - 1.0;
                let y = x * slope + next() / 2048.0;
                Vec4::new(x, y, next() * 2.0 - 1.0, 1.0) * (0.5 + next())
            });
            let outcodes = each(triangle, |position| projector.volume.outcode(position));
            let union = outcodes[0] | outcodes[1] | outcodes[2];
            let mut fan = Fan::new([0; 3], triangle, union, 0, &projector);
            let corners: Vec<_> =
                fan.polygon().iter().map(|corner| projector.project_clipped(&corner.position)).collect();
            let [a, b, c, d] = corners[..] else { continue };
            let side = |p, q, r| signed_area2(p, q, r).signum();
            let meet = |p, q, r, s| side(p, q, r) * side(p, q, s) <= 0 && side(r, s, p) * side(r, s, q) <= 0;
            if meet(a, b, c, d) || meet(b, c, d, a) {
                continue;
            }
            let turns = [side(a, b, c), side(b, c, d), side(c, d, a), side(d, a, b)];
            bent += u32::from(turns.iter().any(|&turn| turn != turns[0]));
            let (mut drawn, whole) = (0, fan.area2().abs());
            while let Some(piece) = fan.next(&projector) {
                drawn += piece.setup.area2();
            }
            assert_eq!(drawn, whole, "{triangle:?}: {corners:?}");
        }
        assert!(bent > 50, "some are bent: {bent}");
    }
}
