//! A turned torus in a window of a 320 × 240 display, between text and shapes of `embedded-graphics`.
//!
//! On a device, `DISPLAY` is its driver (`mipidsi`, `st7789`, `ili9341` …); here it is a framebuffer, and a PNG shows it.

use std::error::Error;
use std::fs::File;
use std::io::BufWriter;
use std::sync::Mutex;

use embedded_graphics::framebuffer::{Framebuffer, buffer_size};
use embedded_graphics::image::GetPixel;
use embedded_graphics::mono_font::MonoTextStyle;
use embedded_graphics::mono_font::ascii::{FONT_7X13, FONT_9X18_BOLD};
use embedded_graphics::pixelcolor::raw::{BigEndian, RawU16};
use embedded_graphics::pixelcolor::{Rgb565, Rgb888};
use embedded_graphics::prelude::*;
use embedded_graphics::primitives::{Arc, PrimitiveStyle, PrimitiveStyleBuilder, Rectangle, StrokeAlignment};
use embedded_graphics::text::{Alignment, Text};
use tiled::{Memory, Model};

const WIDTH: usize = 320;
const HEIGHT: usize = 240;
type Display =
    Framebuffer<Rgb565, RawU16, BigEndian, WIDTH, HEIGHT, { buffer_size::<Rgb565>(WIDTH, HEIGHT) }>;

/// In firmware, what the runtime offers for a static that `main` takes once.
static MEMORY: Mutex<Memory> = Mutex::new(Memory::new());
static DISPLAY: Mutex<Display> = Mutex::new(Display::new());

const BAR: Rgb565 = Rgb565::new(4, 12, 10);
const BRIGHT: Rgb565 = Rgb565::new(31, 58, 26);
const ACCENT: Rgb565 = Rgb565::new(31, 38, 8);

fn main() -> Result<(), Box<dyn Error>> {
    let mut memory = MEMORY.lock().expect("main is the only one");
    let mut display = DISPLAY.lock().expect("main is the only one");
    let display = &mut *display;

    // Below: a bar with a title.
    display.clear(BAR)?;
    let title = MonoTextStyle::new(&FONT_9X18_BOLD, BRIGHT);
    Text::new("halfplane in a window", Point::new(12, 22), title).draw(display)?;

    // The triangles: tile by tile, into a part of the display that looks like a display of its own.
    let window = Rectangle::new(Point::new(12, 34), Size::new(296, 194));
    let model = Model::new(Rectangle::new(Point::zero(), window.size), 0.35)?;
    let statistics = model.draw(&mut display.cropped(&window), &mut memory)?;

    // Above: a frame around the window, a gauge and a note on the picture.
    let frame = PrimitiveStyleBuilder::new()
        .stroke_color(ACCENT)
        .stroke_width(2)
        .stroke_alignment(StrokeAlignment::Outside)
        .build();
    window.into_styled(frame).draw(display)?;
    let gauge = |degrees, color| {
        Arc::new(Point::new(258, 44), 40, (-90.0).deg(), Angle::from_degrees(degrees))
            .into_styled(PrimitiveStyle::with_stroke(color, 5))
    };
    gauge(360.0, BAR).draw(display)?;
    gauge(250.0, ACCENT).draw(display)?;
    let note = MonoTextStyle::new(&FONT_7X13, BRIGHT);
    Text::with_alignment("69%", Point::new(278, 68), note, Alignment::Center).draw(display)?;
    let text = format!("{} fragments, {} bytes of RAM", statistics.fragments, size_of::<Memory>());
    Text::new(&text, Point::new(20, 220), note).draw(display)?;

    write_png("target/examples-output/embedded_graphics.png", display)?;
    println!("{text}");
    Ok(())
}

fn write_png(path: &str, display: &Display) -> Result<(), Box<dyn Error>> {
    let pixels: Vec<u8> = Rectangle::new(Point::zero(), display.size())
        .points()
        .filter_map(|point| display.pixel(point))
        .flat_map(|color| {
            let color = Rgb888::from(color);
            [color.r(), color.g(), color.b()]
        })
        .collect();
    if let Some(directory) = std::path::Path::new(path).parent() {
        std::fs::create_dir_all(directory)?;
    }
    let mut encoder =
        png::Encoder::new(BufWriter::new(File::create(path)?), WIDTH.try_into()?, HEIGHT.try_into()?);
    encoder.set_color(png::ColorType::Rgb);
    encoder.write_header()?.write_image_data(&pixels)?;
    println!("wrote {path} ({WIDTH}x{HEIGHT})");
    Ok(())
}
