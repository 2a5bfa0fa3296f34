//! What the examples share and the rasterizer does not need: models, a camera, a texture, a PNG writer, some formulas.
//!
//! Nothing here draws: `glam` vectors go out, and `0xAABBGGRR` pixels come in.
#![allow(
    dead_code,
    unreachable_pub,
    reason = "written like a crate of its own, of which each example uses a part"
)]

pub mod camera;
pub mod cuts;
pub mod image;
pub mod mesh;
pub mod scene;
pub mod shade;
pub mod teapot;
pub mod texture;
pub mod torus;
