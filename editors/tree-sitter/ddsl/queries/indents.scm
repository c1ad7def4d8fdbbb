[(deployment) (component) (env) (parameters) (slots) (settings) (record) (process) (host) (group) (bind_block) (convert_block) (peer) (network_record) (chain) (world)] @indent.begin @indent
"}" @indent.branch @indent.end @outdent
