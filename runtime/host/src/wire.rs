//! Values in messages.

use rc_middleware::{EncodeError, Encoding, Reader, Writer};
use rc_values::{Struct, Value, ValueError, copy as copy_cdr, decode, decode_from, encode};
use std::sync::Arc;

/// Writes a value that was checked against its type.
pub fn write(value: &Value, writer: &mut Writer<'_>) {
    if let Err(error) = encode(value, writer) {
        writer.fail(EncodeError::NoValue(error.to_string()));
    }
}

/// Reads a structure in either encoding.
pub fn read(ty: &Arc<Struct>, reader: &mut Reader<'_>) -> Result<Value, ValueError> {
    match reader.image() {
        Some(image) => decode(ty, Encoding::Image, image),
        None => decode_from(ty, reader),
    }
}

/// Copies a structure in either encoding as CDR.
pub(crate) fn copy(
    ty: &Arc<Struct>,
    reader: &mut Reader<'_>,
    writer: &mut Writer<'_>,
) -> Result<(), ValueError> {
    match reader.image() {
        Some(image) => encode(&decode(ty, Encoding::Image, image)?, writer),
        None => copy_cdr(ty, reader, writer),
    }
}
