// SPDX-License-Identifier: GPL-3.0-or-later
// All that an instruction set has, for the device.
#include "device_cpu/cpu.h"

#define PT_NAME_(isa) "cpu-" #isa
#define PT_NAME(isa) PT_NAME_(isa)
#define PT_X(name) PT_KERNEL_ENTRY(name),
const struct pt_cpu_isa PT_CONCAT(pt_cpu_isa_, PT_ISA) = {PT_NAME(PT_ISA), {PT_EACH_KERNEL(PT_X)}, PT_KERNEL_ENTRY(tail)};
