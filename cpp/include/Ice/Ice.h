// For workers of RoboComp that include Ice: the base of the errors of calls.
#pragma once

#include "robocomp/errors.h"
