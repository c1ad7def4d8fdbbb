//! Values of types that are known at run time: decoded from CDR or memory images, printed as text
//! and JSON, read from JSON, and encoded again.
//!
//! - [`description`]: the description of an IDSL module, which generated code embeds.
//! - [`Catalog`]: the types and interfaces of several modules, with all names resolved.
//! - [`Value`]: a value of one of these types.
//!
//! Bytes, JSON and descriptions may come from anywhere: a mistake is an error, and a value
//! takes memory in proportion to its bytes.
//!
//! ```
//! use rc_middleware::Encoding;
//! use rc_values::{Catalog, decode, description::Module, encode_body, from_json};
//!
//! let module: Module = serde_json::from_str(
//!     r#"{"module": "Demo",
//!         "types": [{"name": "Point", "struct": [{"name": "x", "type": "float32", "unit": "mm"}]}],
//!         "interfaces": [{"name": "PointPub", "operations": [
//!             {"name": "moved", "id": 1, "hash": "00000000000000aa", "pattern": "publish",
//!              "inputs": [{"name": "to", "type": "Demo::Point"}]}]}]}"#,
//! )?;
//! let catalog = Catalog::new(&[module])?;
//! let interface = catalog.interface("Demo::PointPub").expect("it is in the module");
//! let moved = interface.operation("moved").expect("it is in the interface");
//! let value = from_json(&moved.request, &serde_json::json!({"to": {"x": 1.5}}))?;
//! let body = encode_body(&value)?;
//! assert_eq!(body, 1.5_f32.to_le_bytes());
//! let back = decode(&moved.request, Encoding::Cdr, &body)?;
//! assert_eq!(serde_json::to_string(&back)?, r#"{"to":{"x":1.5}}"#);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod budget;
mod catalog;
mod cells;
mod checks;
mod copy;
mod decode;
pub mod description;
mod encode;
mod error;
mod image;
mod json;
mod numbers;
mod parse;
mod quick;
mod text;
mod types;
mod unique;
mod value;

pub use catalog::{Catalog, Exception, Interface, Operation};
pub use cells::{Columns, csv_cell};
pub use checks::written;
pub use copy::{borrow, copy};
pub use decode::{decode, decode_from};
pub use encode::{encode, encode_body};
pub use error::{DescriptionError, ValueError};
pub use image::{
    check_image, decode_image, encode_image, image_members, read_member_image, write_member_image,
};
pub use json::{default, from_json};
pub use numbers::Numbers;
pub use rc_vocabulary::Pattern;
pub use text::Style;
pub use types::{
    Enum, Layout, Member, Named, Number, Primitive, Range, Struct, Type, layout, limit_json,
};
pub use unique::json_of_person;
pub use value::Value;
