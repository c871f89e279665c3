// Deprecated: cells.hpp has what of a cell lies in a ball. This header goes in version 0.3.
#pragma once

#include "cells.hpp"
