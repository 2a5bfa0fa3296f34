//! Triangles on whatever `embedded-graphics` can draw to: a display behind SPI, a simulator, a part of either.
//!
//! [`draw_by_tiles`] is the bridge, and the part to copy: it knows neither the display nor what is drawn. The rest of this
//! file is a model to draw. There is no heap: all memory is [`Memory`], 15 KiB, and belongs in a `static`.
#![no_std]

use core::fmt;

use embedded_graphics::pixelcolor::{Rgb565, raw::RawU16};
use embedded_graphics::prelude::{DrawTarget, Point, RgbColor, Size};
use embedded_graphics::primitives::Rectangle;
use halfplane::glam::{Mat4, Vec4, vec3};
use halfplane::{
    Attributes, Computed, CullMode, DrawError, Grid, GridError, Positions, Primitives, ProjectedVertex,
    Rasterizer, Rect, Statistics, Surface, SurfaceError, Viewport, ViewportError, pack_rgb565,
};

#[path = "../../support/torus.rs"]
mod torus;

/// What a tile of a display looks like to the rasterizer: the display's own pixels, and 16-bit depth.
pub type Tile<'a> = Surface<&'a mut [Rgb565], &'a mut [u16]>;

/// Draws a frame tile by tile: clears a tile, has `draw` draw into it, hands it to the display.
///
/// * The frame is all of `display`, in its coordinates: `draw` should draw with a viewport of the same rectangle. To draw
///   into a part of a display, pass its `cropped` part.
/// * `color` and `depth` hold one tile, `tile.width * tile.height` pixels.
/// * `draw` is called once for each tile, with the same bits as one call for a whole frame would give.
///
/// # Errors
/// What the display, the rasterizer or `draw` say.
pub fn draw_by_tiles<D: DrawTarget<Color = Rgb565>>(
    display: &mut D,
    tile: Size,
    color: &mut [Rgb565],
    depth: &mut [u16],
    background: Rgb565,
    mut draw: impl FnMut(&mut Tile<'_>) -> Result<Statistics, DrawError>,
) -> Result<Statistics, Error<D::Error>> {
    let grid = Grid::new(rect(display.bounding_box()), tile.width, tile.height)?;
    let mut statistics = Statistics::default();
    for area in grid.tiles() {
        color.fill(background);
        depth.fill(u16::MAX);
        let mut surface = Surface::with_planes(&mut *color, &mut *depth, area, area.width as usize)?;
        statistics += draw(&mut surface)?;

        // The tiles at the right and lower borders may be smaller: their pixels lie one after the other all the same.
        let window = Rectangle::new(Point::new(area.x, area.y), Size::new(area.width, area.height));
        let pixels = color.iter().copied().take((area.width * area.height) as usize);
        display.fill_contiguous(&window, pixels).map_err(Error::Display)?;
    }
    Ok(statistics)
}

/// The same rectangle, in the rasterizer's words.
pub fn rect(Rectangle { top_left: Point { x, y }, size: Size { width, height } }: Rectangle) -> Rect {
    Rect { x, y, width, height }
}

const TILE: Size = Size::new(64, 32);
const TILE_PIXELS: usize = (TILE.width * TILE.height) as usize;

/// All memory that drawing the model takes.
pub struct Memory {
    color: [Rgb565; TILE_PIXELS],
    depth: [u16; TILE_PIXELS],
    vertices: [ProjectedVertex; torus::CORNERS],
}

impl Memory {
    /// For a `static`.
    pub const fn new() -> Self {
        Self {
            color: [Rgb565::BLACK; TILE_PIXELS],
            depth: [0; TILE_PIXELS],
            vertices: [ProjectedVertex::BLANK; torus::CORNERS],
        }
    }
}

impl Default for Memory {
    fn default() -> Self {
        Self::new()
    }
}

/// The model: a torus, turned, with light on it.
pub struct Model {
    rasterizer: Rasterizer<f32>,
    turned: Mat4,
    to_clip: Mat4,
}

impl Model {
    pub const BACKGROUND: Rgb565 = Rgb565::new(2, 5, 4);

    /// For a frame that is `area` of a display.
    ///
    /// # Errors
    /// When there is nothing of it.
    pub fn new(area: Rectangle, angle: f32) -> Result<Self, ViewportError> {
        let Rect { x, y, width, height } = rect(area);
        let [x, y, width, height] = [x as f32, y as f32, width as f32, height as f32];
        let mut rasterizer = Rasterizer::new(Viewport::new(x, y, width, height)?);
        rasterizer.cull_mode = CullMode::Back;
        let (turned, to_clip) = torus::matrices(angle, width / height);
        Ok(Self { rasterizer, turned, to_clip })
    }

    /// Draws it tile by tile.
    ///
    /// # Errors
    /// Those of [`draw_by_tiles`].
    pub fn draw<D: DrawTarget<Color = Rgb565>>(
        &self,
        display: &mut D,
        memory: &mut Memory,
    ) -> Result<Statistics, Error<D::Error>> {
        let Memory { color, depth, vertices } = memory;
        // Each vertex once a frame, not once a tile.
        let vertices = self.rasterizer.project(self.positions(), vertices)?;
        draw_by_tiles(display, TILE, color, depth, Self::BACKGROUND, |tile| self.draw_tile(tile, vertices))
    }

    /// Draws what of it lies in a tile, or in a whole frame.
    ///
    /// # Errors
    /// None, unless the model is broken.
    pub fn draw_tile(&self, tile: &mut Tile<'_>, positions: impl Positions) -> Result<Statistics, DrawError> {
        let light = Computed::new(torus::CORNERS, |i| torus::brightness(self.turned, i));
        let list = Primitives::list().indexed(&torus::INDICES);
        self.rasterizer.draw(tile, list, positions, light, |fragment| {
            Rgb565::from(RawU16::new(pack_rgb565(vec3(0.2, 0.85, 0.75) * fragment.varyings())))
        })
    }

    /// Its corners in clip space.
    pub fn positions(&self) -> impl Attributes<Value = Vec4> + Copy {
        Computed::new(torus::CORNERS, |i| self.to_clip * torus::corner(i).0.extend(1.0))
    }
}

/// Why a frame was not drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Error<E> {
    /// The display's own error.
    Display(E),
    /// The memory for a tile is too small.
    Surface(SurfaceError),
    /// A tile without pixels.
    Grid(GridError),
    /// What [`Rasterizer::draw`] says.
    Draw(DrawError),
}

impl<E: fmt::Display> fmt::Display for Error<E> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Display(error) => error.fmt(f),
            Self::Surface(error) => error.fmt(f),
            Self::Grid(error) => error.fmt(f),
            Self::Draw(error) => error.fmt(f),
        }
    }
}

impl<E: fmt::Debug + fmt::Display> core::error::Error for Error<E> {}

impl<E> From<SurfaceError> for Error<E> {
    fn from(error: SurfaceError) -> Self {
        Self::Surface(error)
    }
}

impl<E> From<GridError> for Error<E> {
    fn from(error: GridError) -> Self {
        Self::Grid(error)
    }
}

impl<E> From<DrawError> for Error<E> {
    fn from(error: DrawError) -> Self {
        Self::Draw(error)
    }
}
