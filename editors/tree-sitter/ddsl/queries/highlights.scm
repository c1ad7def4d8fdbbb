(comment) @comment
["address" "after" "age" "all" "and" "arch" "args" "at" "backoff" "bind" "build" "by" "cdsl" "chain" "component" "config" "convert" "cpu" "deployment" "domain" "endpoint" "env" "exact" "executable" "export" "external" "false" "frames" "from" "group" "h" "host" "hung" "import" "jobs" "keep" "late" "link" "max" "middleware" "min" "ms" "nice" "not" "or" "parameters" "priority" "process" "proxy" "ready" "record" "remote" "require" "restart" "ring" "s" "schema" "simulated" "slots" "start" "stop" "system" "through" "time" "to" "transport" "true" "us" "user" "via" "within" "workspace" "world"] @keyword
(deployment "deployment" . (name) @type)
(component "component" . (name) @type)
(host_ref "host" . (name) @type)
(process_ref "process" . (name) @type)
(after "after" . (name) @type)
(restart "restart" . (name) @type)
(middleware "middleware" . (name) @type)
(remote "remote" . (name) @type)
(process "process" . (name) @type)
(host "host" . (name) @type)
(host_arch "arch" . (name) @type)
(host_build "build" . (name) @type)
(group "group" . (name) @type)
(export "export" . (name) @type)
(via "via" . (name) @type)
(frames "frames" . (name) @type)
(network_time "by" . (name) @type)
(chain "chain" . (name) @type)
(chain_late "late" . (name) @type)
(world "world" . (name) @type)
(string) @string
(number) @number
(duration) @number
["(" ")" "[" "]" "{" "}"] @punctuation.bracket
["!" "!=" "&&" "*" "+" "," "-" "->" "." "/" ";" "<" "<=" "=" "==" ">" ">=" "||"] @punctuation.delimiter
