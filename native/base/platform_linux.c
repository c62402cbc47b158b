// SPDX-License-Identifier: GPL-3.0-or-later
// Of platform.h, what is Linux's own, with the GNU C library.
#include "platform.h"

#include <fcntl.h>
#include <sched.h>
#include <string.h>
#include <unistd.h>

uint32_t pt_core_count(void)
{
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0)
        return (uint32_t)CPU_COUNT(&set);
    return 1;
}

void pt_processor_name(char *text, size_t size)
{
    char line[256];
    FILE *file = fopen("/proc/cpuinfo", "re");
    snprintf(text, size, "processor");
    while (file && fgets(line, sizeof line, file))
        if (!strncmp(line, "model name", 10)) {
            const char *value = strchr(line, ':');
            if (value)
                snprintf(text, size, "%.*s", (int)strcspn(value + 1, "\n"), value + 1 + strspn(value + 1, " "));
            text[strcspn(text, "\n")] = 0;
            break;
        }
    if (file)
        fclose(file);
}

uint64_t pt_peak_memory(void)
{
    char line[256];
    unsigned long kib = 0;
    FILE *status = fopen("/proc/self/status", "re");
    while (status && fgets(line, sizeof line, status))
        if (sscanf(line, "VmHWM: %lu", &kib) == 1)
            break;
    if (status)
        fclose(status);
    return (uint64_t)kib << 10;
}

uint64_t pt_free_memory(void)
{
    char line[256];
    unsigned long kib = 0;
    FILE *about = fopen("/proc/meminfo", "re");
    while (about && fgets(line, sizeof line, about))
        if (sscanf(line, "MemAvailable: %lu", &kib) == 1)
            break;
    if (about)
        fclose(about);
    return (uint64_t)kib << 10;
}

// Asked every half millisecond: no stream.
uint64_t pt_file_memory(void)
{
    char text[256];
    unsigned long pages = 0;
    const int descriptor = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
    const ssize_t length = descriptor < 0 ? 0 : read(descriptor, text, sizeof text - 1);
    if (descriptor >= 0)
        close(descriptor);
    text[length > 0 ? length : 0] = 0;
    return sscanf(text, "%*u %*u %lu", &pages) == 1 ? (uint64_t)pages * (uint64_t)sysconf(_SC_PAGESIZE) : 0;
}

const char *pt_error_text(int error, char *buffer, size_t size)
{
    return strerror_r(error, buffer, size);
} // GNU's, which returns it
