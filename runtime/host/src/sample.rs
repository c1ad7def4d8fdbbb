//! Received samples and replies: values, or images that a view reads in place.

use crate::Aligned;
use crate::description::Operation;
use crate::kept_count::KeptCount;
use crate::replies::undecodable;
use crate::wire::read;
use rc_middleware::typed::HandlerError;
use rc_middleware::{DecodeError, Encoding, KEPT_SAMPLES, KeptSample, Reader};
use rc_values::{Struct, Value, decode_from, encode_image};
use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

/// A received sample.
pub enum Sample {
    /// For a handler that gets values.
    Value(Value),
    /// For a handler that gets a view.
    Image(Image),
}

/// The image of a sample.
pub enum Image {
    /// A copy.
    Copied(Aligned),
    /// The sample itself. Its publisher has the memory again when this is dropped.
    Kept(Box<dyn KeptSample>, KeptCount),
}

impl Sample {
    /// Reads a sample of a topic.
    ///
    /// # Errors
    /// It is not of its type.
    pub fn read(operation: &Operation, reader: &mut Reader<'_>) -> Result<Self, HandlerError> {
        if operation.in_place {
            return Image::read(operation, reader).map(Self::Image);
        }
        let value = read(&operation.request, reader).map_err(undecodable)?;
        Ok(Self::Value(value))
    }

    /// [`Image::keep`] for a topic in place.
    ///
    /// # Errors
    /// Those of [`Image::keep`].
    pub fn keep(
        operation: &Operation,
        kept: &Arc<AtomicUsize>,
        encoding: Encoding,
        sample: Box<dyn KeptSample>,
    ) -> Result<Self, HandlerError> {
        Image::keep(operation, kept, encoding, sample).map(Self::Image)
    }
}

impl Image {
    /// Reads a sample of a topic in place. A value becomes an image.
    ///
    /// # Errors
    /// It is not of its type.
    pub fn read(operation: &Operation, reader: &mut Reader<'_>) -> Result<Self, HandlerError> {
        Ok(Self::Copied(copied(&operation.request, reader)?))
    }

    /// Takes a sample of a topic, of which the worker keeps so many. It stays in its place for as
    /// long as the worker has a view of it.
    ///
    /// # Errors
    /// It is not of its type, or the worker keeps as many as it may.
    pub fn keep(
        operation: &Operation,
        kept: &Arc<AtomicUsize>,
        encoding: Encoding,
        sample: Box<dyn KeptSample>,
    ) -> Result<Self, HandlerError> {
        if encoding != Encoding::Image {
            return Self::read(operation, &mut Reader::of(sample.memory(), encoding));
        }
        check(&operation.request, sample.memory())?;
        match KeptCount::one(kept) {
            Some(kept_count) => Ok(Self::Kept(sample, kept_count)),
            None => Err(HandlerError(format!(
                "the worker keeps {KEPT_SAMPLES} samples of `{}`, the most that it may, so {}() does \
                 not get the next ones; drop views of earlier samples, or keep what their copy() \
                 returns",
                operation.name, operation.handler
            ))),
        }
    }
}

/// A copy of an image that follows, or the image of a value in the other encoding.
pub(crate) fn copied(ty: &Arc<Struct>, reader: &mut Reader<'_>) -> Result<Aligned, DecodeError> {
    if let Some(image) = reader.image() {
        check(ty, image)?;
        return Ok(Aligned::copied(image));
    }
    let value = decode_from(ty, reader).map_err(undecodable)?;
    let image = encode_image(&value).map_err(undecodable)?;
    Ok(Aligned::copied(&image))
}

fn check(ty: &Struct, image: &[u8]) -> Result<(), DecodeError> {
    let expected = ty.layout.map_or(0, |layout| layout.size);
    if image.len() == expected {
        return Ok(());
    }
    Err(DecodeError::NotAnImage {
        what: "the operation",
        length: image.len(),
        expected,
    })
}
