[(component) (communications) (qos) (world_block) (dependencies) (reactions)] @indent.begin @indent
"}" @indent.branch @indent.end @outdent
