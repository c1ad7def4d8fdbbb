[(component) (communications) (qos) (world_block) (dependencies) (reactions)] @fold
(comment) @fold
