//! The same frames on a computer: compares them with what the firmware sent, and makes a picture of them.
//!
//! `host FILE PICTURE`: FILE is what came over the display's bus; PICTURE, a PNG, shows its frames side by side.

use std::convert::Infallible;
use std::error::Error;
use std::fs::{self, File};
use std::io::BufWriter;

use embedded_graphics_core::pixelcolor::{IntoStorage, Rgb565};
use embedded_graphics_core::prelude::{DrawTarget, OriginDimensions, Pixel, Size};
use spinning::{FRAMES, Renderer, SIZE};

const SIDE: usize = SIZE as usize;
const PIXELS: usize = SIDE * SIDE;
const ACROSS: usize = 4;

/// A display in memory.
struct Display(Vec<u16>);

impl OriginDimensions for Display {
    fn size(&self) -> Size {
        Size::new(SIZE.into(), SIZE.into())
    }
}

impl DrawTarget for Display {
    type Color = Rgb565;
    type Error = Infallible;

    fn draw_iter<I: IntoIterator<Item = Pixel<Rgb565>>>(&mut self, pixels: I) -> Result<(), Infallible> {
        for Pixel(point, color) in pixels {
            self.0[point.y as usize * SIDE + point.x as usize] = color.into_storage();
        }
        Ok(())
    }
}

/// The controller of a display: takes windows and pixels until a frame is full, and returns what follows.
fn receive<'a>(mut bytes: &'a [u8], frame: &mut [u16]) -> Result<&'a [u8], &'static str> {
    fn word(bytes: &mut &[u8]) -> Result<u16, &'static str> {
        let (word, rest) = bytes.split_first_chunk().ok_or("the firmware's last frame is not complete")?;
        *bytes = rest;
        Ok(u16::from_be_bytes(*word))
    }
    let mut missing = PIXELS;
    while missing > 0 {
        let [x, y, width, height] =
            [word(&mut bytes)?, word(&mut bytes)?, word(&mut bytes)?, word(&mut bytes)?];
        for row in y..y + height {
            for column in x..x + width {
                *frame
                    .get_mut(usize::from(row) * SIDE + usize::from(column))
                    .ok_or("a window beside the display")? = word(&mut bytes)?;
                missing = missing.checked_sub(1).ok_or("more pixels than a frame has")?;
            }
        }
    }
    Ok(bytes)
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [sent, picture] = arguments.as_slice() else { return Err("usage: host FILE PICTURE".into()) };
    let sent = fs::read(sent)?;
    let mut renderer = Box::new(Renderer::new());
    renderer.build();

    let (mut bytes, mut frames, mut differing) = (sent.as_slice(), Vec::new(), 0);
    for number in (0..FRAMES).step_by(usize::from(FRAMES / 8)) {
        let (mut received, mut display) = (vec![0; PIXELS], Display(vec![0; PIXELS]));
        bytes = receive(bytes, &mut received)?;
        match renderer.draw(number, &mut display).ok_or("a constant is wrong")? {
            Ok(()) => differing += received.iter().zip(&display.0).filter(|(a, b)| a != b).count(),
            Err(infallible) => match infallible {},
        }
        frames.push(received);
    }
    if !bytes.is_empty() {
        return Err("the firmware sent more than its frames".into());
    }
    write_png(picture, &frames)?;
    if differing > 0 {
        return Err(format!(
            "{differing} of {} pixels differ from the host's: see {picture}",
            frames.len() * PIXELS
        )
        .into());
    }
    println!("{} frames of {SIDE} x {SIDE} pixels, equal to the host's: see {picture}", frames.len());
    Ok(())
}

fn write_png(path: &str, frames: &[Vec<u16>]) -> Result<(), Box<dyn Error>> {
    let rows = frames.len().div_ceil(ACROSS) * SIDE;
    let mut encoder =
        png::Encoder::new(BufWriter::new(File::create(path)?), (ACROSS * SIDE).try_into()?, rows.try_into()?);
    encoder.set_color(png::ColorType::Rgb);
    let mut rgb = vec![0; ACROSS * SIDE * rows * 3];
    for (i, frame) in frames.iter().enumerate() {
        for (at, &pixel) in frame.iter().enumerate() {
            let (x, y) = (i % ACROSS * SIDE + at % SIDE, i / ACROSS * SIDE + at / SIDE);
            let channel = |shift: u16, bits: u16| {
                (u32::from(pixel >> shift & ((1 << bits) - 1)) * 255 / ((1 << bits) - 1)) as u8
            };
            rgb[(y * ACROSS * SIDE + x) * 3..][..3].copy_from_slice(&[
                channel(11, 5),
                channel(5, 6),
                channel(0, 5),
            ]);
        }
    }
    encoder.write_header()?.write_image_data(&rgb)?;
    Ok(())
}
