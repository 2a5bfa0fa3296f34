//! Bands: a few neighbouring rows of a triangle, solved, and what their fragments start from.

#![expect(clippy::cast_possible_truncation, reason = "rows of a band are under 2⁴")]

use core::hint::black_box;

use crate::coarse::DepthRow;
use crate::fragment::WeightParts;
use crate::interpolate::Varyings;
use crate::packet::Triangle;
use crate::plane::{DepthPlane, RowPlane};
use crate::setup::Setup;
use crate::target::Borders;
use crate::traverse::{LANES, Solver};

/// Some rows of a triangle, ready to be shaded.
pub(crate) struct Band {
    /// Changes along a row, of what weights are made of and of depth.
    pub(crate) step: WeightParts,
    pub(crate) step_z: f32,
    /// Columns `start .. end` of each row, cut to the area: of a row beside it, `start` may be behind `end`. And its anchor.
    pub(crate) start: [i32; LANES],
    pub(crate) end: [i32; LANES],
    pub(crate) anchor: [i32; LANES],
    /// How many columns each row's start lies behind its anchor.
    pub(crate) dx: [f32; LANES],
    /// What weights are made of, and depth, at the anchors.
    pub(crate) parts: [[f32; LANES]; 5],
    pub(crate) z: [f32; LANES],
    /// The topmost row, and how many there are.
    pub(crate) y: i32,
    pub(crate) count: usize,
    /// Where the triangle ends.
    pub(crate) bottom: i32,
}

impl Band {
    /// Above the first rows.
    #[inline(always)]
    pub(crate) fn new<V: Varyings>(setup: &Setup, triangle: Triangle<'_, V>, area: Borders) -> Self {
        let bounds = setup.borders();
        Self {
            step: triangle.shading.step_x(),
            step_z: triangle.plane.step_x(setup),
            start: [0; LANES],
            end: [0; LANES],
            anchor: [0; LANES],
            dx: [0.0; LANES],
            parts: [[0.0; LANES]; 5],
            z: [0.0; LANES],
            y: bounds.top.max(area.top),
            count: 0,
            bottom: bounds.bottom.min(area.bottom),
        }
    }

    /// Solves the next rows and cuts them to the area. False when there are no more.
    #[inline(always)]
    pub(crate) fn solve<V: Varyings>(
        &mut self,
        solver: &Solver,
        triangle: Triangle<'_, V>,
        area: Borders,
    ) -> bool {
        self.y += self.count as i32;
        if self.y >= self.bottom {
            return false;
        }
        let rows = solver.solve(self.y);
        self.count = LANES.min((self.bottom - self.y) as usize);
        // As if they changed from band to band. Else LLVM fills registers with them before the first, and does so for tiny
        // triangles, too, which have no band. (Number by number: to load several, their stores would have to be waited for.)
        let plane = triangle.plane.map(black_box);
        let scales = triangle.shading.scales.map(black_box);
        let (left, right) = (area.left, area.right);
        for row in 0..LANES {
            self.start[row] = rows.start[row].max(left);
            self.end[row] = rows.end[row].min(right);
            // (Wrapping: a row that covers nothing may have any numbers, and nobody asks for its.)
            self.dx[row] = self.start[row].wrapping_sub(rows.anchor[row]) as f32;
            self.z[row] = plane.at_edges(rows.edges[0][row], rows.edges[1][row]);
        }
        self.anchor = rows.anchor;
        let [a, b, c] = &rows.edges;
        for row in 0..LANES {
            let at = scales.parts([a[row], b[row], c[row]]);
            let [p, q, sum, l, m] = &mut self.parts;
            (p[row], q[row], sum[row], l[row], m[row]) = (at.p, at.q, at.sum, at.l, at.m);
        }
        true
    }

    /// The plane of depth along rows.
    #[inline(always)]
    pub(crate) fn plane<'a>(&self, plane: &'a DepthPlane) -> RowPlane<'a> {
        RowPlane::new(plane, self.step_z)
    }

    /// Depth on a row.
    #[inline(always)]
    pub(crate) fn depth<'a>(&self, plane: &'a DepthPlane, row: usize) -> DepthRow<'a> {
        let (plane, z, anchor) = (self.plane(plane), self.z[row], self.anchor[row]);
        DepthRow { plane, y: self.y + row as i32, z, anchor }
    }

    /// What weights are made of at a row's anchor.
    #[inline(always)]
    pub(crate) fn base(&self, row: usize) -> WeightParts {
        let [p, q, sum, l, m] = &self.parts;
        WeightParts { p: p[row], q: q[row], sum: sum[row], l: l[row], m: m[row] }
    }
}
