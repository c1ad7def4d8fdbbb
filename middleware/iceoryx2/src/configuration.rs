//! The configuration of a node.

use crate::incomplete_files::CREATION;
use crate::names::Storage;
use iceoryx2::prelude::{Config, FileName, Path, SemanticString};
use rc_middleware::qos::{MAX_PUBLISHERS, MAX_READERS};
use std::fmt::Debug;
use std::os::unix::ffi::OsStrExt;

/// The configuration of the node. Without one, iceoryx2 reads `./config/iceoryx2.toml`.
pub(crate) fn configuration(place: &Storage) -> Result<Config, String> {
    let root = &place.root;
    let says = |error: &dyn Debug| format!("{} as its root: {error:?}", root.display());
    let mut config = Config::default();
    let path = Path::new(root.as_os_str().as_bytes()).map_err(|e| says(&e))?;
    config.global.set_root_path(&path);
    config.global.prefix = FileName::new(place.prefix.as_bytes()).map_err(|e| says(&e))?;
    config.global.creation_timeout = CREATION;
    // Clean-ups run exclusively, see [`open_lock`].
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config.global.service.cleanup_dead_nodes_on_open = false;
    // Buffers for unread messages of removed ports, 2 to 6 kB each; the default is 128 everywhere.
    config
        .defaults
        .publish_subscribe
        .subscriber_expired_connection_buffer = 2 * MAX_PUBLISHERS;
    config
        .defaults
        .request_response
        .server_expired_connection_buffer = MAX_READERS;
    config
        .defaults
        .request_response
        .client_expired_connection_buffer = 4;
    Ok(config)
}
