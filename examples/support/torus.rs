//! A torus that needs no memory: its corners are computed, its indices lie in flash. `core` only.

use core::f32::consts::TAU;
use halfplane::glam::{Mat4, Vec2, Vec3, camera::rh::proj::directx, vec3};

/// So many corners around it, and around its tube.
pub const AROUND: usize = 32;
pub const TUBE: usize = 14;
pub const CORNERS: usize = AROUND * TUBE;

/// Corner `i`, and the direction away from the surface there.
pub fn corner(i: usize) -> (Vec3, Vec3) {
    let turn = |i: usize, of: usize| Vec2::from_angle(TAU * i as f32 / of as f32);
    let (around, tube) = (turn(i / TUBE, AROUND), turn(i % TUBE, TUBE));
    let normal = vec3(around.x * tube.x, tube.y, around.y * tube.x);
    (vec3(around.x, 0.0, around.y) + normal * 0.45, normal)
}

/// The corners of its triangles.
#[allow(clippy::cast_possible_truncation, reason = "there are 448 corners")]
pub const INDICES: [u16; CORNERS * 6] = {
    let mut indices = [0; CORNERS * 6];
    let mut i = 0;
    while i < CORNERS {
        // This corner, the next along the tube, and both of the next ring.
        let (ring, next_ring) = (i / TUBE * TUBE, (i / TUBE + 1) % AROUND * TUBE);
        let (here, up) = (i % TUBE, (i % TUBE + 1) % TUBE);
        let [a, b, c, d] = [ring + here, ring + up, next_ring + here, next_ring + up];
        let corners = [a, b, c, c, b, d];
        let mut j = 0;
        while j < 6 {
            indices[6 * i + j] = corners[j] as u16;
            j += 1;
        }
        i += 1;
    }
    indices
};

/// How it is turned, and from there to clip space.
pub fn matrices(angle: f32, aspect_ratio: f32) -> (Mat4, Mat4) {
    let model =
        Mat4::from_rotation_x(0.7) * Mat4::from_rotation_z(angle) * Mat4::from_rotation_y(angle * 2.0);
    let projection = directx::perspective(0.8, aspect_ratio, 1.0, 10.0);
    (model, projection * Mat4::from_translation(vec3(0.0, 0.0, -4.2)) * model)
}

/// How much light falls on corner `i`.
pub fn brightness(model: Mat4, i: usize) -> f32 {
    model.transform_vector3(corner(i).1).dot(vec3(0.36, 0.8, 0.48)).max(0.0) * 0.9 + 0.1
}
