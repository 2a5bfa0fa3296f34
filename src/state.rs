//! Pipeline state that has no room of its own, and what a draw tells of itself.

/// Whose values [`Flat`](crate::Flat) varyings take: see the table of [`Topology`](crate::Topology).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum ProvokingVertex {
    /// Vulkan, Direct3D, Metal, WebGPU.
    #[default]
    First,
    /// OpenGL, unless told otherwise.
    Last,
}

/// Which triangles are left out by the side that they show (`VkCullModeFlags`).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum CullMode {
    /// None is left out.
    #[default]
    None,
    /// Those that show their front.
    Front,
    /// Those that show their back: half the work for closed meshes.
    Back,
}

/// Which way the vertices of a triangle turn, as displayed, when it shows its front (`VkFrontFace`).
///
/// Judged after rounding to the subpixel grid, by the sign of the exact area.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum FrontFace {
    /// Counter-clockwise.
    #[default]
    CounterClockwise,
    /// Clockwise.
    Clockwise,
}

/// What a draw did.
///
/// ```text
///   primitives = invalid + outside + culled + degenerate + those that are left to draw
/// ```
///
/// Those that are left are traversed, unless they lie beside the render area or between samples. Clipped ones are culled,
/// degenerate or left.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[non_exhaustive]
pub struct Statistics {
    /// Triangles that primitive assembly made.
    pub primitives: u64,
    /// Triangles skipped because a coordinate was NaN, infinite or beyond 2¹⁰⁰. (Not for an x or y beyond, if its vertex
    /// lies near the frame once divided by w.)
    pub invalid: u64,
    /// Triangles of which nothing lies inside of the clip volume.
    pub outside: u64,
    /// Triangles that a plane of the clip volume or the guard band cut, and of which something was left.
    pub clipped: u64,
    /// Triangles left out by [`CullMode`].
    pub culled: u64,
    /// Triangles without area on the subpixel grid.
    pub degenerate: u64,
    /// Fragments that passed the depth test and were shaded: how often the closure ran. (Of a depth-only draw: would have. Those of
    /// [`Staged`](crate::Staged) draws may run more often.)
    pub fragments: u64,
    /// Fragments that were not discarded either: an occlusion query's answer.
    pub samples_passed: u64,
}

impl core::ops::AddAssign for Statistics {
    fn add_assign(&mut self, other: Self) {
        self.primitives += other.primitives;
        self.invalid += other.invalid;
        self.outside += other.outside;
        self.clipped += other.clipped;
        self.culled += other.culled;
        self.degenerate += other.degenerate;
        self.fragments += other.fragments;
        self.samples_passed += other.samples_passed;
    }
}
