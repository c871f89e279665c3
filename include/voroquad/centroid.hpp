// Deprecated: cells.hpp has the centres of mass of cells. This header goes in version 0.3.
#pragma once

#include "cells.hpp"
