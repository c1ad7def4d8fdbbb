[(deployment) (component) (env) (parameters) (slots) (settings) (record) (process) (host) (group) (bind_block) (convert_block) (peer) (network_record) (chain) (world)] @fold
(comment) @fold
