//! What a display is sent, tile by tile, is what a framebuffer for all of it would hold, bit for bit.

use std::convert::Infallible;

use embedded_graphics::framebuffer::{Framebuffer, buffer_size};
use embedded_graphics::image::GetPixel;
use embedded_graphics::mock_display::MockDisplay;
use embedded_graphics::pixelcolor::Rgb565;
use embedded_graphics::pixelcolor::raw::{BigEndian, RawU16};
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::Rectangle;
use halfplane::{Statistics, Surface};
use tiled::{Error, Memory, Model, Tile, draw_by_tiles, rect};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
type Display =
    Framebuffer<Rgb565, RawU16, BigEndian, WIDTH, HEIGHT, { buffer_size::<Rgb565>(WIDTH, HEIGHT) }>;

/// A frame in one piece, and how many fragments it has.
fn whole(model: &Model, Size { width, height }: Size) -> (Vec<Rgb565>, u64) {
    let pixels = (width * height) as usize;
    let (mut color, mut depth) = (vec![Model::BACKGROUND; pixels], vec![u16::MAX; pixels]);
    let mut target = Surface::new(&mut color[..], &mut depth[..], width, height).expect("large enough");
    let statistics = model.draw_tile(&mut target, model.positions()).expect("a sound model");
    (color, statistics.samples_passed)
}

#[test]
fn tiles_on_a_display_are_the_whole_frame() {
    let (mut display, mut memory) = (Display::new(), Memory::new());
    for angle in [0.35, 1.2, 4.0] {
        let model = Model::new(display.bounding_box(), angle).expect("a display with pixels");
        let statistics = model.draw(&mut display, &mut memory).expect("a framebuffer takes all");
        let (expected, samples) = whole(&model, display.size());
        assert_eq!(statistics.samples_passed, samples);
        assert!(samples > 10_000, "there is something to see");
        for (point, expected) in display.bounding_box().points().zip(expected) {
            assert_eq!(display.pixel(point), Some(expected), "{point} at {angle}");
        }
    }
}

#[test]
fn a_part_of_a_display_gets_the_whole_frame_and_the_rest_stays() {
    let (mut display, mut memory) = (Display::new(), Memory::new());
    display.clear(Rgb565::MAGENTA).expect("a framebuffer takes all");
    // Sides that are no multiples of a tile's, and so narrow that the model fills the narrower tiles too.
    let window = Rectangle::new(Point::new(13, 34), Size::new(100, 177));
    let model = Model::new(Rectangle::new(Point::zero(), window.size), 0.35).expect("a window with pixels");
    model.draw(&mut display.cropped(&window), &mut memory).expect("a framebuffer takes all");
    let (expected, _) = whole(&model, window.size);
    for (point, expected) in window.points().zip(expected) {
        assert_eq!(display.pixel(point), Some(expected), "{point}");
    }
    for point in display.bounding_box().points().filter(|&point| !window.contains(point)) {
        assert_eq!(display.pixel(point), Some(Rgb565::MAGENTA), "{point}");
    }
}

#[test]
fn every_pixel_is_sent_once_and_none_beside_the_display() {
    // It panics when a pixel is drawn twice or lies outside.
    let mut display = MockDisplay::<Rgb565>::new();
    let (mut color, mut depth) = ([Rgb565::BLACK; 24 * 20], [0; 24 * 20]);
    let mut areas = Vec::new();
    draw_by_tiles(
        &mut display,
        Size::new(24, 20),
        &mut color,
        &mut depth,
        Rgb565::CYAN,
        |tile: &mut Tile<'_>| {
            areas.push(tile.area());
            Ok(Statistics::default())
        },
    )
    .expect("it takes all");
    assert_eq!(areas.len(), 3 * 4);
    assert_eq!(display.affected_area(), display.bounding_box());
    assert!(display.bounding_box().points().all(|point| display.get_pixel(point) == Some(Rgb565::CYAN)));
}

#[test]
fn too_little_memory_and_empty_tiles_are_errors() {
    let draw =
        |tile, pixels| {
            let (mut color, mut depth) = (vec![Rgb565::BLACK; pixels], vec![0; pixels]);
            let mut display = MockDisplay::<Rgb565>::new();
            draw_by_tiles(&mut display, tile, &mut color, &mut depth, Rgb565::BLACK, |_| {
                Ok(Statistics::default())
            })
            .map(drop)
        };
    assert!(matches!(draw(Size::new(16, 16), 255), Err(Error::Surface(_))));
    assert!(matches!(draw(Size::new(0, 16), 255), Err(Error::Grid(_))));
}

/// A display that sends what it is given, as drivers do.
struct Trusting(u64);

impl OriginDimensions for Trusting {
    fn size(&self) -> Size {
        Size::new(100, 100)
    }
}

impl DrawTarget for Trusting {
    type Color = Rgb565;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb565>>>(&mut self, _: I) -> Result<(), Infallible> {
        unreachable!("tiles are contiguous")
    }

    fn fill_contiguous<I>(&mut self, area: &Rectangle, colors: I) -> Result<(), Infallible>
    where
        I: IntoIterator<Item = Rgb565>,
    {
        let sent = colors.into_iter().count() as u64;
        assert_eq!(sent, u64::from(area.size.width * area.size.height), "{area:?}");
        self.0 += sent;
        Ok(())
    }
}

#[test]
fn a_window_is_sent_as_many_colors_as_it_has_pixels() {
    let mut display = Trusting(0);
    let model = Model::new(display.bounding_box(), 0.0).expect("a display with pixels");
    model.draw(&mut display, &mut Memory::new()).expect("it takes all");
    assert_eq!(display.0, 100 * 100);
}

/// A display that fails at the second tile.
struct Unplugged(u32);

impl OriginDimensions for Unplugged {
    fn size(&self) -> Size {
        Size::new(64, 64)
    }
}

impl DrawTarget for Unplugged {
    type Color = Rgb565;
    type Error = &'static str;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb565>>>(&mut self, _: I) -> Result<(), Self::Error> {
        self.0 += 1;
        if self.0 > 1 { Err("unplugged") } else { Ok(()) }
    }
}

#[test]
fn an_error_of_the_display_ends_the_frame() {
    let mut display = Unplugged(0);
    let model = Model::new(display.bounding_box(), 0.0).expect("a display with pixels");
    let error = model.draw(&mut display, &mut Memory::new()).expect_err("the second tile fails");
    assert_eq!((error, display.0), (Error::Display("unplugged"), 2));
}

#[test]
fn rectangles_have_the_same_meaning() {
    let window = Rectangle::new(Point::new(-3, 5), Size::new(7, 2));
    let area = rect(window);
    let all = Rectangle::new(Point::new(-8, -8), Size::new(32, 32));
    assert!(all.points().all(|point| window.contains(point) == area.contains(point.x, point.y)));
}
