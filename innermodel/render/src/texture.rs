//! Textures: pictures on the sides of boxes.

use innermodel::{Transform, Vector};
use std::fs::File;
use std::io::{self, Cursor, Read};
use std::path::Path;
use thiserror::Error;
use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

/// The largest file that is read, in bytes.
const LARGEST: u64 = 64 << 20;
/// The greatest width and height in pixels.
const MOST_SIDE: usize = 8192;

/// Why a file gives no texture.
#[derive(Debug, Error)]
#[non_exhaustive]
pub enum TextureError {
    /// There is no such file, or nobody has looked for it.
    #[error("the file was not found when the node was read")]
    NotFound,
    /// The system cannot read the file.
    #[error("{0}")]
    Unreadable(#[from] io::Error),
    /// The file is larger than 64 MiB, or the picture than 8192 × 8192 pixels.
    #[error("expected at most 64 MiB and 8192 × 8192 pixels")]
    TooLarge,
    /// The content is neither PNG nor JPEG.
    #[error("expected a picture in PNG or JPEG")]
    UnknownFormat,
    /// The content is wrong.
    #[error("{0}")]
    Wrong(String),
}

/// A picture.
#[derive(Debug)]
pub(crate) struct Texture {
    width: usize,
    height: usize,
    pixels: Vec<[u8; 3]>,
}

impl Texture {
    /// Reads a file. Its first bytes tell its format.
    pub(crate) fn read(path: &Path) -> Result<Self, TextureError> {
        // Check before opening: opening a device can have side effects.
        let about = std::fs::metadata(path)?;
        if !about.is_file() {
            return Err(io::Error::other("this is not a regular file").into());
        }
        if about.len() > LARGEST {
            return Err(TextureError::TooLarge);
        }
        let mut bytes = Vec::new();
        File::open(path)?.take(LARGEST).read_to_end(&mut bytes)?;
        if bytes.starts_with(b"\x89PNG") {
            from_png(&bytes)
        } else if bytes.starts_with(b"\xff\xd8") {
            from_jpeg(&bytes)
        } else {
            Err(TextureError::UnknownFormat)
        }
    }

    /// The colour at a place, from (0, 0) at the top left to (1, 1).
    fn at(&self, u: f64, v: f64) -> [u8; 3] {
        let place = |part: f64, count: usize| ((part * count as f64) as usize).min(count - 1);
        self.pixels[place(v, self.height) * self.width + place(u, self.width)]
    }
}

fn wrong(error: &dyn std::fmt::Display) -> TextureError {
    TextureError::Wrong(error.to_string())
}

fn texture(width: usize, height: usize, pixels: Vec<[u8; 3]>) -> Result<Texture, TextureError> {
    if width == 0 || height == 0 || pixels.len() != width * height {
        return Err(TextureError::Wrong("the picture is cut".to_owned()));
    }
    Ok(Texture {
        width,
        height,
        pixels,
    })
}

fn from_png(bytes: &[u8]) -> Result<Texture, TextureError> {
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    // Palettes and bits become bytes, 16 bits become 8.
    decoder.set_transformations(png::Transformations::normalize_to_color8());
    let mut reader = decoder.read_info().map_err(|e| wrong(&e))?;
    let (width, height) = (reader.info().width as usize, reader.info().height as usize);
    if width.max(height) > MOST_SIDE {
        return Err(TextureError::TooLarge);
    }
    let size = reader.output_buffer_size().ok_or(TextureError::TooLarge)?;
    let mut data = vec![0; size];
    let frame = reader.next_frame(&mut data).map_err(|e| wrong(&e))?;
    let data = &data[..frame.buffer_size()];
    let samples = frame.color_type.samples();
    let pixels = data.chunks_exact(samples).map(|pixel| match *pixel {
        [red, green, blue, ..] => [red, green, blue],
        [grey, ..] => [grey; 3],
        [] => [0; 3],
    });
    texture(width, height, pixels.collect())
}

fn from_jpeg(bytes: &[u8]) -> Result<Texture, TextureError> {
    let options = DecoderOptions::default()
        .set_max_width(MOST_SIDE)
        .set_max_height(MOST_SIDE)
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(Cursor::new(bytes), options);
    let data = decoder.decode().map_err(|e| wrong(&e))?;
    let (width, height) = decoder.dimensions().unwrap_or_default();
    texture(width, height, data.as_chunks::<3>().0.to_vec())
}

/// What a surface looks like.
#[derive(Clone, Copy)]
pub(crate) enum Paint<'c> {
    /// The same everywhere.
    Colour([u8; 3]),
    /// Each side of a box shows a picture, upright as seen from outside.
    Box {
        texture: &'c Texture,
        /// The lengths of the box.
        size: [f64; 3],
        /// From the camera to the box.
        to_box: Transform,
    },
}

impl Paint<'_> {
    /// The colour at a point of the surface, in the frame of the camera.
    pub(crate) fn at(&self, point: &Vector) -> [u8; 3] {
        let (texture, size, to_box) = match self {
            Self::Colour(colour) => return *colour,
            Self::Box {
                texture,
                size,
                to_box,
            } => (texture, size, to_box),
        };
        let point = to_box.vector(point) + to_box.translation;
        // From −0.5 to 0.5 along each axis; a box without a depth has none there.
        let part = [0, 1, 2].map(|axis| {
            let part = point[axis] / size[axis];
            if part.is_finite() { part } else { 0.5 }
        });
        let [x, y, z] = part;
        // The side is where the point is farthest out. y is up, and the side of −z is the front.
        let (right, up) = if z.abs() >= x.abs().max(y.abs()) {
            (-x * z.signum(), y)
        } else if x.abs() >= y.abs() {
            (z * x.signum(), y)
        } else {
            (x, z * y.signum())
        };
        texture.at((right + 0.5).clamp(0.0, 1.0), (0.5 - up).clamp(0.0, 1.0))
    }
}
