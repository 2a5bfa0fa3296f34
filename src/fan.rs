//! What clipping leaves of a triangle: a convex polygon, drawn as a fan of triangles.
//!
//! A piece of a fan is a triangle like any other, except that its corners have a history: their weights over the three
//! vertices that the caller knows.

use glam::Vec4;

use crate::clip::{Corner, Polygon};
use crate::fragment::{Identity, Pedigree};
use crate::interpolate::{Varyings, Weights};
use crate::project::{ProjectedVertex, Projector};
use crate::setup::signed_area2;
use crate::triple::each;

/// A triangle, or a piece of one that was clipped, which may cover samples.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) corners: [ProjectedVertex; 3],
    /// Twice the signed area; not zero.
    pub(crate) area2: i64,
    /// The caller's vertices.
    pub(crate) vertices: [usize; 3],
    pub(crate) identity: Identity,
    /// Which piece of a [`Fan`] it is: corners 0, this and the next one. Zero for a whole triangle.
    pub(crate) in_fan: usize,
}

/// What clipping leaves of a triangle, as a fan of triangles.
#[derive(Debug)]
pub(crate) struct Fan {
    /// The caller's vertices, their positions with depth in 0 ≤ z ≤ w, and which planes they lie outside of.
    vertices: [usize; 3],
    positions: [Vec4; 3],
    outcodes: u8,
    polygon: Polygon,
    projector: Projector,
    pub(crate) identity: Identity,
    /// Twice the signed area of all of it.
    area2: i64,
    /// The next piece.
    next: usize,
}

impl Fan {
    pub(crate) fn new(
        vertices: [usize; 3],
        positions: [Vec4; 3],
        outcodes: u8,
        projector: Projector,
    ) -> Self {
        let polygon = projector.volume.clip(positions, outcodes);
        let identity = Identity { provoking: 0, is_front_facing: false, primitive: 0 };
        let mut fan = Self { vertices, positions, outcodes, polygon, projector, identity, area2: 0, next: 1 };
        let mut piece = 1;
        while let Some([a, b, c]) = fan.piece(piece) {
            fan.area2 += signed_area2(a, b, c);
            piece += 1;
        }
        fan
    }

    /// What it was made of: positions, and which planes they lie outside of.
    pub(crate) fn origin(&self) -> ([Vec4; 3], u8) {
        (self.positions, self.outcodes)
    }

    /// Whether clipping leaves nothing.
    pub(crate) fn is_empty(&self) -> bool {
        self.polygon.corners().is_empty()
    }

    /// Twice the signed area of all of it, as it stands on the subpixel grid.
    pub(crate) fn area2(&self) -> i64 {
        self.area2
    }

    /// The w of the caller's vertices.
    fn w(&self) -> [f32; 3] {
        each(self.positions, |position| position.w)
    }

    fn corners(&self, piece: usize) -> Option<[&Corner; 3]> {
        let corners = self.polygon.corners();
        Some([corners.first()?, corners.get(piece)?, corners.get(piece + 1)?])
    }

    fn piece(&self, piece: usize) -> Option<[ProjectedVertex; 3]> {
        Some(each(self.corners(piece)?, |corner| self.projector.project_clipped(corner.position)))
    }

    #[inline(never)]
    pub(crate) fn next(&mut self) -> Option<Piece> {
        loop {
            let in_fan = self.next;
            let corners = self.piece(in_fan)?;
            self.next += 1;
            // Rounding can turn a sliver over. What it would cover belongs to its neighbours.
            let [a, b, c] = corners;
            let area2 = signed_area2(a, b, c);
            if area2.signum() == self.area2.signum() {
                return Some(Piece {
                    corners,
                    area2,
                    vertices: self.vertices,
                    identity: self.identity,
                    in_fan,
                });
            }
        }
    }

    /// How a piece's corners came about.
    pub(crate) fn pedigree(&self, piece: usize) -> Option<Pedigree> {
        let (corners, w) = (self.corners(piece)?, self.w());
        Some(Pedigree {
            weights: each(corners, |corner| corner.weights),
            barycentrics: each(corners, |corner| corner.barycentrics(w)),
        })
    }

    /// The values at a piece's corners, from those at the vertices.
    pub(crate) fn varyings<V: Varyings>(&self, piece: usize, values: [V; 3]) -> [V; 3] {
        let Some(corners) = self.corners(piece) else { return values };
        each(corners, |corner| {
            let weights =
                Weights::new(corner.weights, corner.barycentrics(self.w()), self.identity.provoking);
            V::interpolate(&values, &weights)
        })
    }
}
