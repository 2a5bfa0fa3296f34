//! Clipping: what to cut away before dividing by w.
//!
//! Only what the arithmetic cannot bear or the contract forbids is cut: w ≤ 0, the near and far planes, and a guard band
//! so far outside the frame that few triangles ever meet it. The frame's border itself cuts nothing; the render area
//! bounds the traversal instead, so edges stay where they are.
//!
//! Cutting works on the position and on weights over the triangle's three original vertices. Whatever is to be
//! interpolated is then made from the originals, once for each vertex that the cut leaves: varyings of any type survive,
//! flat ones too.

use glam::Vec4;

use crate::target::EXTENT;
use crate::viewport::{Viewport, ViewportTransform};

/// Whether triangles are cut at the near and far planes (Vulkan's `depthClampEnable`, Direct3D's `DepthClipEnable`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum DepthClip {
    /// Fragments nearer than the near plane or farther than the far plane do not exist.
    #[default]
    Clip,
    /// They exist, with depths clamped to the viewport's depth range. What lies behind the eye is still cut.
    Clamp,
}

/// The smallest w that is kept: 2⁻⁶⁴. Then 1/w times an edge function of 2⁴⁷ stays far from infinity.
pub(crate) const W_MIN: f32 = f32::from_bits((127 - 64) << 23);

/// The largest magnitude of any coordinate: 2¹⁰⁰, about 1.27 · 10³⁰. Then distances to planes stay finite.
const COORDINATE_MAX: f32 = f32::from_bits((127 + 100) << 23);

/// How far from the origin, in pixels, a vertex may lie at the most. 2²² subpixels still snap exactly.
pub(crate) const GUARD_BAND: f32 = EXTENT as f32;

/// How far it may lie unless the viewport reaches farther: below 2¹⁴ pixels an `f32` is twice as fine as at them.
const USUAL_GUARD_BAND: f32 = (EXTENT - 1) as f32;

const PLANES: u8 = 7;

/// Outcode bit of a position that is no point: NaN, infinite or beyond [`COORDINATE_MAX`].
pub(crate) const INVALID: u8 = 1 << PLANES;

/// The part of clip space that is kept.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ClipVolume {
    /// To framebuffer coordinates.
    pub(crate) transform: ViewportTransform,
    clips_depth: bool,
    guard_band: f32,
}

/// A corner of what clipping leaves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Corner {
    /// In clip space; of a `Vec4`, whose alignment is 16, the corner would take 32 bytes and not 28.
    pub(crate) position: [f32; 4],
    /// Its perspective weights over the three vertices of the triangle.
    pub(crate) weights: [f32; 3],
}

impl ClipVolume {
    pub(crate) fn new(viewport: &Viewport, depth_clip: DepthClip) -> Self {
        let guard_band = if viewport.reach() > USUAL_GUARD_BAND { GUARD_BAND } else { USUAL_GUARD_BAND };
        Self { transform: viewport.transform(), clips_depth: depth_clip == DepthClip::Clip, guard_band }
    }

    /// Whether a position is kept, given its framebuffer coordinates. False whenever anything is NaN.
    #[inline(always)]
    pub(crate) fn contains(&self, position: Vec4, x: f32, y: f32) -> bool {
        let [_, _, z, w] = position.to_array();
        let (near, far) = if self.clips_depth { (0.0, w) } else { (-COORDINATE_MAX, COORDINATE_MAX) };
        let is_in = |x: f32, low: f32, high: f32| (low <= x) & (x <= high);
        is_in(w, W_MIN, COORDINATE_MAX)
            & is_in(x, -self.guard_band, self.guard_band)
            & is_in(y, -self.guard_band, self.guard_band)
            & is_in(z, near, far)
    }

    /// Whether four positions are all kept: [`contains`](Self::contains), one in each lane.
    #[inline(always)]
    pub(crate) fn contains_four(&self, [x, y, z, w]: [Vec4; 4]) -> bool {
        let largest = Vec4::splat(COORDINATE_MAX);
        let (near, far) = if self.clips_depth { (Vec4::ZERO, w) } else { (-largest, largest) };
        let is_in = |x: Vec4, low: Vec4, high: Vec4| low.cmple(x) & x.cmple(high);
        let (left, right) = (Vec4::splat(-self.guard_band), Vec4::splat(self.guard_band));
        (is_in(w, Vec4::splat(W_MIN), largest)
            & is_in(x, left, right)
            & is_in(y, left, right)
            & is_in(z, near, far))
        .all()
    }

    /// Which planes the position lies outside of, a bit each. [`INVALID`] instead when it is no point.
    pub(crate) fn outcode(&self, position: Vec4) -> u8 {
        if !position.to_array().iter().all(|c| (-COORDINATE_MAX..=COORDINATE_MAX).contains(c)) {
            return INVALID;
        }
        (0..PLANES).fold(0, |code, plane| {
            code | (u8::from(self.distance(plane, position.to_array()) < 0.0) << plane)
        })
    }

    /// The signed distance to a plane in some unit: not negative inside, linear in the position.
    fn distance(&self, plane: u8, [x, y, z, w]: [f32; 4]) -> f32 {
        let ViewportTransform { scale, offset } = self.transform;
        let x = x * scale[0] + w * offset[0]; // framebuffer coordinate times w
        let y = y * scale[1] + w * offset[1];
        let side = w * self.guard_band;
        match plane {
            0 => w - W_MIN,
            1 if self.clips_depth => z,
            2 if self.clips_depth => w - z,
            3 => side + x,
            4 => side - x,
            5 => side + y,
            6 => side - y,
            _ => 0.0,
        }
    }

    /// Cuts away of the triangle in `room` what lies outside of some planes. Gives how many corners are left: they stand at
    /// its start, in the same winding order.
    #[inline(never)]
    pub(crate) fn clip(&self, room: &mut Room, planes: u8) -> usize {
        let mut len = 3;
        for plane in (0..PLANES).filter(|plane| planes >> plane & 1 == 1) {
            len = self.cut(room, len, plane).unwrap_or_default();
        }
        len
    }

    /// Keeps the part of a polygon of `len` corners inside a plane: as many corners as it gives, or none.
    ///
    /// The corners outside follow one another, because the polygon is convex; two cuts take their place.
    fn cut(&self, room: &mut Room, len: usize, plane: u8) -> Option<usize> {
        let corners = room.get_mut(..len)?;
        let distance = |corner: &Corner| self.distance(plane, corner.position);
        // The first corner inside after one outside; where there is none, no corner is.
        let (mut start, mut outside) = (len, 0);
        let mut was_inside = distance(corners.last()?) >= 0.0;
        for (i, corner) in corners.iter().enumerate() {
            let is_inside = distance(corner) >= 0.0;
            if is_inside && !was_inside && start == len {
                start = i;
            }
            outside += usize::from(!is_inside);
            was_inside = is_inside;
        }
        if outside == 0 {
            return Some(len);
        }
        // Turn the polygon so that it starts there. Three reversals: what `rotate_left` does in general costs a
        // microcontroller 1.5 KiB.
        let (front, back) = corners.split_at_mut_checked(start)?;
        reverse(front);
        reverse(back);
        reverse(corners);
        let kept = corners.iter().take_while(|corner| distance(corner) >= 0.0).count();
        let (first, second) = (kept, kept + 1);
        let mut count = kept;
        // The second cut first: where the first will stand, its edge may end.
        for (place, inside, outside) in [(second, 0, len - 1), (first, kept.checked_sub(1)?, kept)] {
            let (a, b) = (room.get(inside)?, room.get(outside)?);
            let (mut cut, rounding) = Corner::between(a, b, distance(a), distance(b));
            let is_corner = plane != 0 || cut.settle_on_eye_plane(rounding);
            if is_corner {
                *room.get_mut(place)? = cut;
                count += 1;
            } else if place == first && count == second {
                // Only the second: it moves up.
                reverse(room.get_mut(first..=second)?);
            }
        }
        Some(count)
    }
}

/// Where a triangle is clipped: one cut by seven planes has at most ten corners.
pub(crate) type Room = [Corner; 10];

/// A triangle, ready to be clipped.
#[inline(always)]
pub(crate) fn room_of([a, b, c]: [Vec4; 3]) -> Room {
    let [a, b, c] = [
        Corner { position: a.to_array(), weights: [1.0, 0.0, 0.0] },
        Corner { position: b.to_array(), weights: [0.0, 1.0, 0.0] },
        Corner { position: c.to_array(), weights: [0.0, 0.0, 1.0] },
    ];
    [a, b, c, c, c, c, c, c, c, c]
}

/// `slice::reverse`, in a tenth of its code.
#[inline(never)]
fn reverse(mut corners: &mut [Corner]) {
    while let [first, rest @ .., last] = corners {
        core::mem::swap(first, last);
        corners = rest;
    }
}

/// Puts the first corner behind the last.
pub(crate) fn turn(corners: &mut [Corner]) {
    reverse(corners);
    if let [rest @ .., _] = corners {
        reverse(rest);
    }
}

/// The larger of |x| and |y|.
fn size([x, y, _, _]: [f32; 4]) -> f32 {
    let (x, y) = (x.abs(), y.abs());
    if x > y { x } else { y }
}

impl Corner {
    /// The point of an edge where the distance to a plane is zero, from those of its ends, which are of opposite signs.
    ///
    /// A weighted mean of both ends, not a step from one of them: the small end's rounding error does not grow with the
    /// large one, and since `+` commutes, both triangles at an edge compute the same bits whichever way they walk it.
    ///
    /// Also gives how far rounding may have moved it.
    fn between(a: &Self, b: &Self, da: f32, db: f32) -> (Self, f32) {
        let whole = da - db;
        let (ka, kb) = (-db / whole, da / whole);
        let ([p, q, r], [s, t, u]) = (a.weights, b.weights);
        let (from_a, from_b) = (a.position.map(|c| c * ka), b.position.map(|c| c * kb));
        let [x, y, z, w] = from_a;
        let position = [x + from_b[0], y + from_b[1], z + from_b[2], w + from_b[3]];
        let cut = Self { position, weights: [p * ka + s * kb, q * ka + t * kb, r * ka + u * kb] };
        (cut, (size(from_a) + size(from_b)) * f32::EPSILON)
    }

    /// A cut at w ≈ 0, where w is far smaller than the rounding error of the cut: that may bring a w of zero or below. And
    /// of an edge that runs through the eye nothing but rounding is left, which would point anywhere: no corner then.
    fn settle_on_eye_plane(&mut self, rounding: f32) -> bool {
        let w = &mut self.position[3];
        *w = if *w > W_MIN { *w } else { W_MIN };
        size(self.position) > rounding
    }
}

#[cfg(test)]
mod tests {
    extern crate std;
    use super::*;
    use std::vec::Vec;

    fn volume() -> ClipVolume {
        ClipVolume::new(&Viewport::of_size(64, 64).expect("valid"), DepthClip::Clip)
    }

    fn clip(triangle: [Vec4; 3]) -> Vec<Corner> {
        let volume = volume();
        let outcodes = triangle.iter().fold(0, |codes, &p| codes | volume.outcode(p));
        let mut room = room_of(triangle);
        let len = volume.clip(&mut room, outcodes);
        room[..len].to_vec()
    }

    #[test]
    fn one_vertex_behind_the_near_plane_leaves_a_quad() {
        let corners = clip([
            Vec4::new(0.0, 1.0, -1.0, 1.0),
            Vec4::new(-1.0, -1.0, 1.0, 1.0),
            Vec4::new(1.0, -1.0, 1.0, 1.0),
        ]);
        assert_eq!(corners.len(), 4, "{corners:?}");
        let on_plane: Vec<_> = corners.iter().filter(|c| c.position[2] == 0.0).collect();
        assert_eq!(on_plane.len(), 2, "{corners:?}");
        assert!(on_plane.iter().all(|c| c.weights[0] == 0.5), "half way to the vertex behind: {corners:?}");
    }

    #[test]
    fn two_vertices_behind_the_near_plane_leave_a_triangle() {
        let corners = clip([
            Vec4::new(0.0, 1.0, 1.0, 1.0),
            Vec4::new(-1.0, -1.0, -1.0, 1.0),
            Vec4::new(1.0, -1.0, -1.0, 1.0),
        ]);
        assert_eq!(corners.len(), 3, "{corners:?}");
    }

    #[test]
    fn everything_behind_leaves_nothing() {
        let behind = Vec4::new(0.0, 0.0, -1.0, -2.0);
        assert!(clip([behind, behind + Vec4::X, behind + Vec4::Y]).is_empty(), "all outside");
    }

    #[test]
    fn both_neighbours_of_an_edge_cut_it_at_the_same_point() {
        let (p, q) = (Vec4::new(0.3, 0.7, -0.1, 0.2), Vec4::new(-5.0, 2.0, 30.0, 31.0));
        let left = clip([p, q, Vec4::new(1.0, -1.0, 2.0, 3.0)]);
        let right = clip([q, p, Vec4::new(-4.0, 1.0, 5.0, 7.0)]);
        let cut = |corners: &[Corner]| {
            corners
                .iter()
                .find(|c| c.weights[2] == 0.0 && c.weights[0] * c.weights[1] > 0.0)
                .map(|c| c.position)
        };
        assert!(cut(&left).is_some() && cut(&left) == cut(&right), "{left:?} {right:?}");
    }

    #[test]
    fn what_is_no_point_has_an_outcode_of_its_own() {
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
            assert_eq!(volume().outcode(Vec4::new(0.0, bad, 0.5, 1.0)), INVALID, "{bad}");
        }
        assert_eq!(volume().outcode(Vec4::new(1e30, 0.0, 0.5, 1.0)) & INVALID, 0, "1e30 is a point");
        assert_eq!(volume().outcode(Vec4::new(0.0, 0.0, 0.5, 1.0)), 0, "inside");
    }
}
