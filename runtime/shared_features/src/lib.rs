//! No code: the manifest says what this crate is for.

use anstyle as _;
use hashbrown as _;
use libc as _;
use memchr as _;
use serde_core as _;
use serde_json as _;
