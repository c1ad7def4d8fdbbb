// Definitions for generated headers of types, clients and publishers.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <tuple>
#include <utility>
#include <vector>

#include "robocomp/cdr.h"
#include "robocomp/client.h"
#include "robocomp/errors.h"
#include "robocomp/in_place.h"
#include "robocomp/members.h"
