//! What clipping leaves of a triangle: a convex polygon, drawn as a fan of triangles.
//!
//! A piece of a fan is a triangle like any other, except that its corners have a history: their weights over the three
//! vertices that the caller knows.

use glam::Vec4;

use crate::clip::{Corner, Room, room_of};
use crate::fragment::{Identity, Pedigree};
use crate::interpolate::{Varyings, Weights};
use crate::project::{ProjectedVertex, Projector};
use crate::setup::{Setup, signed_area2};
use crate::triple::each;

/// A triangle, or a piece of one that was clipped, which may cover samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) setup: Setup,
    /// The caller's vertices.
    pub(crate) vertices: [usize; 3],
    pub(crate) identity: Identity,
    /// Which piece of a [`Fan`] it is: corners 0, this and the next one. Zero for a whole triangle.
    pub(crate) in_fan: usize,
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

/// Twice the signed area of a polygon on the subpixel grid. What it leaves in `projected` means nothing.
#[inline(always)]
pub(crate) fn polygon_area2(
    polygon: &[Corner],
    projector: &Projector,
    projected: &mut [ProjectedVertex; 3],
) -> i64 {
    let (mut area2, mut piece) = (0, 1);
    while let Some(of_piece) = project_piece(polygon, piece, projector, projected) {
        area2 += of_piece;
        piece += 1;
    }
    area2
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

/// What clipping leaves of a triangle, as a fan of triangles.
#[derive(Debug)]
pub(crate) struct Fan {
    /// The caller's vertices, their positions with depth in 0 ≤ z ≤ w, and which planes they lie outside of.
    vertices: [usize; 3],
    positions: [Vec4; 3],
    outcodes: u8,
    /// The polygon, as many as `len`.
    corners: Room,
    len: usize,
    pub(crate) identity: Identity,
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
        projector: &Projector,
    ) -> Self {
        let corners = room_of(positions);
        let identity = Identity { provoking: 0, is_front_facing: false, primitive: 0 };
        let mut fan = Self { vertices, positions, outcodes, corners, len: 3, identity, area2: 0, next: 1 };
        fan.len = projector.volume.clip(&mut fan.corners, outcodes);
        fan.area2 = polygon_area2(fan.polygon(), projector, &mut [ProjectedVertex::BLANK; 3]);
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
            // Rounding can turn a sliver over. What it would cover belongs to its neighbours.
            if area2.signum() == self.area2.signum() {
                let setup = Setup::with_area2(corners, area2);
                return Some(Piece { setup, vertices: self.vertices, identity: self.identity, in_fan });
            }
        }
    }

    /// Where a piece's corners come from.
    pub(crate) fn history(&self, piece: usize) -> Option<History> {
        let weights = each(piece_of(self.polygon(), piece)?, |corner| corner.weights);
        Some(History { weights, w: each(self.positions, |position| position.w) })
    }
}
