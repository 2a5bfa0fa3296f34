//! A triangle rasterizer that other programs build on: exact, fast, and without memory of its own.
//!
//! `halfplane` turns triangles in clip space into fragments: clipping, viewport, snapping, setup, traversal, depth test,
//! perspective-correct weights. You bring the memory (the framebuffer, any pixel format) and the shading (a closure).
//! Nothing allocates, nothing is global, nothing is `unsafe`; it is `no_std` everywhere and needs glam alone.
//!
#![doc = "```"]
#![doc = include_str!("../examples/hello_triangle.rs")]
#![doc = "```"]
//!
//! # The way of a triangle
//!
//! ```text
//!  primitive assembly ─► clip ─► project ─► setup ─► traverse ─► depth ─► weights ─► your closure ─► your memory
//!  Primitives           DepthClip  Projected   Setup    Span       DepthTest  Fragment                  Framebuffer
//!  Attributes           ClipDepth  Viewport             Coverage   DepthBias  Varyings                  Surface
//! ```
//!
//! [`Rasterizer`] is the hub: its fields are the pipeline state, [`Rasterizer::draw`] the way through. Each station is
//! usable alone: a renderer that bins triangles itself takes [`Setup`] and its spans without `Rasterizer`.
//!
//! * Vertices come from anything that answers "what is the value at vertex `i`?": see [`Attributes`]. A vertex shader is
//!   [`Computed`]. [`Rasterizer::project`] projects each vertex of an indexed mesh once.
//! * What is interpolated is [`Varyings`]: numbers, vectors, arrays, tuples, your structs ([`varyings!`]); [`Flat`] and
//!   [`NoPerspective`] qualify them.
//! * The picture goes to a [`Framebuffer`]: [`Surface`] over your slices, or your own memory; with
//!   [`CoarseDepth`] around it, what is hidden is left out early.
//! * A closure with a texture is faster in two: [`Rasterizer::staged`].
//! * A frame in tiles or bands, one after the other or in threads of yours: [`Grid`] cuts it; [`Rasterizer::prepare`]
//!   does the geometry once, into [`Record`]s; [`Rasterizer::bin`] says which of them touch which tile.
//!
//! # Conventions
//!
//! | | |
//! | --- | --- |
//! | clip space | x right, y up, 0 ≤ z ≤ w (Direct3D, Vulkan, WebGPU); −w ≤ z ≤ w with [`ClipDepth::NegativeOneToOne`] |
//! | matrices | glam's `camera::rh::proj::directx`; its `vulkan` ones with a viewport of negative height; its `opengl` ones with [`ClipDepth::NegativeOneToOne`] |
//! | framebuffer | pixel (0, 0) top left, y down; the sample of pixel (x, y) at (x + ½, y + ½) |
//! | depth | viewport depth, 0 near to 1 far; [`Less`] and a buffer cleared to 1 by default; reverse Z with [`Greater`], a buffer cleared to 0 and, for instance, `directx::perspective_infinite_reverse` |
//! | front face | counter-clockwise as displayed |
//! | subpixels | 1/256 pixel; vertices are rounded to the nearest, to even in ties |
//! | fill rule | top-left (Direct3D 11.3 functional specification §3.4.2.1) |
//! | limits | frames up to 16 384 × 16 384 pixels, coordinates within [`EXTENT`] of the origin |
//!
//! # Words
//!
//! | | |
//! | --- | --- |
//! | sample | the point of a pixel where coverage is decided: its centre |
//! | fragment | a sample that a triangle covers, on its way to a pixel |
//! | subpixel, 24.8 | 1/256 pixel: a coordinate is an integer of these, with 8 bits behind the point |
//! | snapping | rounding a projected vertex to subpixels |
//! | edge function | an integer, linear on the screen: positive on one side of an edge, 0 on it, negative on the other |
//! | setup | what is worked out once for a triangle |
//! | traversal | finding the samples that a triangle covers |
//! | barycentrics | how much of each vertex is in a sample, linear on the screen: α', β', γ' |
//! | weights | the same, correct in perspective: α, β, γ |
//! | provoking vertex | that of the three whose values [`Flat`] takes |
//! | guard band | how far triangles may reach beyond the viewport without being cut |
//! | watertight | without a gap, and without a sample drawn twice |
//!
//! # What is promised
//!
//! 1. **Every sample once.** Triangles that share an edge cover each sample along it exactly once.
//! 2. **The picture does not depend on how it was cut** into tiles, bands, scissors or threads: a fragment has the same
//!    bits. Every number is a function of the triangle and of (x, y).
//! 3. **The same bits on every target**: only IEEE `+ − × ÷` and exact conversions.
//! 4. **Correct weights**, for any triangle: they sum to 1, and their error does not grow with the range of w or with the
//!    thinness of the triangle (see [`Span`]).
//! 5. **No input breaks it.** NaN and infinities are skipped, w ≤ 0 and 10³⁰ are clipped, and [`Statistics`] count them.
//!    No panic.
//! 6. **No `unsafe`, no allocation, no global state.**
//! 7. **You pay for what you use.** What a closure does not ask of a [`Fragment`] is not computed.
//!
//! # Chapters
//!
//! * [How fast, and why](how_fast): the scenes, the numbers, and how to write a closure that becomes SIMD.
//! * [What lost](what_lost): what was tried for speed and taken out again, and by how much.
//! * [On a microcontroller](on_a_microcontroller): memory, tiles, what to leave out, and what that saves.
//!
//! # Clearing
//!
//! There is no clear: the memory is yours. Fill it before the first draw of a frame (`pixels.fill(…)`, depths with 1, or
//! 0 for reverse Z, or the format's largest value).
//!
//! # Features
//!
//! * `dispatch`: for programs that choose between SIMD at run time, as with the crate `multiversion`. On x86 and x86-64, fragments are
//!   then arranged for registers of eight `f32`, though the crate is compiled for less; the bits are the same. See
//!   [One program, every processor](how_fast#one-program-every-processor).
#![no_std]

pub use glam;

// What everybody speaks of.
mod triple;
mod state;
mod target;
mod tiles;

// From vertices to triangles on the subpixel grid.
mod vertex;
mod primitive;
mod viewport;
mod clip;
mod project;
mod fan;

// A triangle and the samples that it covers: any one, one of up to 16 × 16 pixels, one of up to 2 × 2 samples.
mod edge;
mod setup;
mod traverse;
mod tiny;
mod minute;

// What a fragment is made of.
mod depth;
mod plane;
mod coarse;
mod interpolate;
mod fragment;
mod facing;

// The two halves of a draw: which triangles, and which pixels, with SIMD and without; and the draw.
mod queue;
mod sieve;
mod geometry;
mod ahead;
mod behind;
mod upcoming;
mod packet;
mod columns;
mod closure;
mod band;
mod shade;
mod depth_pass;
mod one_by_one;
mod rasterizer;

// The halves apart, for tiles and threads.
mod prepared;
mod bins;

// The draws once more, with two closures.
mod staged;

// What shaders end with.
mod convert;

pub use bins::{BinError, Binned, Bins};
pub use clip::DepthClip;
pub use coarse::CoarseDepth;
pub use columns::Columns;
pub use convert::{
    floor_to_i32, linear_to_srgb8, pack_bgra8, pack_rgb565, pack_rgba8, pack_srgba8, srgb8_to_linear,
    unpack_rgba8, unpack_srgba8, wrap,
};
pub use depth::{
    Always, CompareOp, Depth24, DepthBias, DepthFormat, DepthState, DepthTest, Equal, Greater,
    GreaterOrEqual, Less, LessOrEqual, Never, NotEqual, ReadOnly,
};
pub use edge::EdgeFunction;
pub use fragment::Fragment;
pub use interpolate::{Flat, NoPerspective, Varyings, Weights};
pub use prepared::{Preparation, Record};
pub use primitive::{Index, IndexBuffer, Primitives, Topology};
pub use project::{Positions, Projected, ProjectedVertex, SUBPIXELS};
pub use rasterizer::{DrawError, Rasterizer};
pub use setup::{Coverage, Setup};
pub use staged::Staged;
pub use state::{CullMode, FrontFace, ProvokingVertex, Statistics};
pub use target::{
    Absent, Bands, Block, Bounds, EXTENT, Framebuffer, Plane, Rect, Run, Surface, SurfaceError,
};
pub use tiles::{Grid, GridError, TileSurfaces};
pub use traverse::Span;
pub use vertex::{Attribute, Attributes, Computed};
pub use viewport::{ClipDepth, Viewport, ViewportError};

#[doc = include_str!("how_fast.md")]
pub mod how_fast {}

#[doc = include_str!("what_lost.md")]
pub mod what_lost {}

#[doc = include_str!("on_a_microcontroller.md")]
pub mod on_a_microcontroller {}

/// The README's code blocks are tests.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
mod readme {}
