//! A camera that circles a sphere.
//!
//! World and view space are right-handed with y up; clip space has x right, y up and z ∈ [0, 1] (glam's
//! `directx` module), so counter-clockwise triangles are front faces.

use halfplane::glam::{Mat4, Vec3, camera::rh::proj::directx};

/// Looks at `target` from `distance` away; the defaults frame the unit sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OrbitCamera {
    /// The point in the middle of the picture.
    pub target: Vec3,
    /// Degrees around the y axis; 0 looks along −z, 90 looks along −x.
    pub yaw: f32,
    /// Degrees above the xz plane; 90 looks straight down.
    pub pitch: f32,
    /// From the eye to the target.
    pub distance: f32,
    /// Vertical field of view in degrees.
    pub fov: f32,
    /// Radius, around the target, of what must not be cut by the near and far planes.
    pub radius: f32,
}

impl Default for OrbitCamera {
    fn default() -> Self {
        Self { target: Vec3::ZERO, yaw: 30.0, pitch: 25.0, distance: 3.2, fov: 36.0, radius: 1.0 }
    }
}

impl OrbitCamera {
    /// World to view space.
    ///
    /// Rotations, not `look_at`: they have no up vector that could be parallel to the view, so ±90° of pitch
    /// work.
    pub fn view(&self) -> Mat4 {
        Mat4::from_translation(Vec3::new(0.0, 0.0, -self.distance))
            * Mat4::from_rotation_x(self.pitch.to_radians())
            * Mat4::from_rotation_y(-self.yaw.to_radians())
            * Mat4::from_translation(-self.target)
    }

    /// The eye in world space.
    pub fn eye(&self) -> Vec3 {
        // The view matrix is a rotation R and a translation t, so the eye −Rᵀt needs no inverse, which glam
        // rounds differently by target.
        let view = self.view();
        let t = view.w_axis.truncate();
        -Vec3::new(
            view.x_axis.truncate().dot(t),
            view.y_axis.truncate().dot(t),
            view.z_axis.truncate().dot(t),
        )
    }

    /// View to clip space, for a picture `aspect` times as wide as it is high.
    pub fn projection(&self, aspect: f32) -> Mat4 {
        // As far out as the sphere allows: the depth's precision goes with near / far. Inside the sphere the
        // near plane cannot follow, and cuts what is closer than a hundredth of the radius.
        let near = (self.distance - self.radius).max(self.radius * 0.01);
        let far = near.max(self.distance) + self.radius;
        directx::perspective(self.fov.to_radians(), aspect, near, far)
    }

    /// World to clip space.
    pub fn view_projection(&self, aspect: f32) -> Mat4 {
        self.projection(aspect) * self.view()
    }
}
