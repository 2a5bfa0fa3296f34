//! An exact, fast triangle rasterizer without memory of its own.
#![no_std]

pub use glam;

mod triple;
mod state;
mod depth;
mod target;
mod tiles;
mod vertex;
mod primitive;
mod viewport;
mod clip;
mod project;
mod edge;
mod setup;
mod traverse;
mod interpolate;
mod fragment;
mod geometry;
mod shade;
mod rasterizer;
mod prepared;
mod bins;
mod convert;

pub use bins::{BinError, Binned, Bins};
pub use clip::DepthClip;
pub use convert::{floor_to_i32, pack_bgra8, pack_rgb565, pack_rgba8, unpack_rgba8, wrap};
pub use depth::{
    Always, CompareOp, Depth24, DepthBias, DepthFormat, DepthState, DepthTest, Equal, Greater,
    GreaterOrEqual, Less, LessOrEqual, Never, NotEqual, ReadOnly,
};
pub use edge::EdgeFunction;
pub use fragment::Fragment;
pub use interpolate::{Flat, NoPerspective, Varyings, Weights};
pub use prepared::{Preparation, Record};
pub use primitive::{Index, Primitives, Topology};
pub use project::{Positions, Projected, ProjectedVertex, SUBPIXELS};
pub use rasterizer::{DrawError, Rasterizer};
pub use setup::{Coverage, Setup};
pub use state::{CullMode, FrontFace, ProvokingVertex, Statistics};
pub use target::{Absent, Bands, EXTENT, Framebuffer, Plane, Rect, Run, Surface, SurfaceError};
pub use tiles::{Grid, GridError, TileSurfaces};
pub use traverse::Span;
pub use vertex::{Attribute, Attributes, Computed};
pub use viewport::{ClipDepth, Viewport, ViewportError};
