// SPDX-License-Identifier: GPL-3.0-or-later
// Of platform.h, what is macOS's own (11 and later).
#include "platform.h"

#include <string.h>
#include <sys/resource.h>
#include <sys/sysctl.h>
#include <unistd.h>

uint32_t pt_core_count(void) // it knows no affinity
{
    const long count = sysconf(_SC_NPROCESSORS_ONLN);
    return count > 0 ? (uint32_t)count : 1;
}

void pt_processor_name(char *text, size_t size)
{
    if (sysctlbyname("machdep.cpu.brand_string", text, &size, NULL, 0))
        snprintf(text, size, "processor");
}

uint64_t pt_peak_memory(void)
{
    struct rusage usage;
    return getrusage(RUSAGE_SELF, &usage) ? 0 : (uint64_t)usage.ru_maxrss; // bytes; kibibytes elsewhere
}

const char *pt_error_text(int error, char *buffer, size_t size)
{
    if (strerror_r(error, buffer, size))
        snprintf(buffer, size, "error %d", error);
    return buffer;
}
