// SPDX-License-Identifier: GPL-3.0-or-later
// Of platform.h, what is Linux's own, with the GNU C library.
#include "platform.h"

#include <fcntl.h>
#include <sched.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
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

// The number behind a word at a line's beginning, or alone in the file (word ""); UINT64_MAX: there is none.
static uint64_t number_in(const char *path, const char *word)
{
    char line[256], *end;
    const size_t length = strlen(word);
    uint64_t found = UINT64_MAX;
    FILE *file = fopen(path, "re");
    while (file && found == UINT64_MAX && fgets(line, sizeof line, file))
        if (!strncmp(line, word, length)) {
            const unsigned long long number = strtoull(line + length, &end, 10);
            found = end > line + length ? number : found;
        }
    if (file)
        fclose(file);
    return found;
}

// What a container or a farm's job (control groups, version 2) may yet take; pages of files go where memory lacks.
static uint64_t left_of_group(void)
{
    char line[256] = "", path[512];
    FILE *file = fopen("/proc/self/cgroup", "re");
    const int read = file && fgets(line, sizeof line, file) && !strncmp(line, "0::", 3);
    if (file)
        fclose(file);
    line[strcspn(line, "\n")] = 0;
    if (!read)
        return UINT64_MAX;
    snprintf(path, sizeof path, "/sys/fs/cgroup%s/memory.max", line + 3);
    const uint64_t most = number_in(path, "");
    snprintf(path, sizeof path, "/sys/fs/cgroup%s/memory.current", line + 3);
    uint64_t used = number_in(path, "");
    if (most == UINT64_MAX || used == UINT64_MAX)
        return UINT64_MAX;
    snprintf(path, sizeof path, "/sys/fs/cgroup%s/memory.stat", line + 3);
    const uint64_t idle = number_in(path, "inactive_file "), files = number_in(path, "active_file ");
    used -= idle < used ? idle : 0;
    used -= files < used ? files : 0;
    return most > used ? most - used : 1; // 0 would say that nobody knows
}

// A third of the addresses that the process may yet have (ulimit -v): kernels and threads reserve many that they never write.
static uint64_t left_of_addresses(void)
{
    struct rlimit limit;
    const uint64_t page = (uint64_t)sysconf(_SC_PAGESIZE), used = number_in("/proc/self/statm", "");
    if (getrlimit(RLIMIT_AS, &limit) || limit.rlim_cur == RLIM_INFINITY || used == UINT64_MAX)
        return UINT64_MAX;
    return limit.rlim_cur > used * page + 3 ? (limit.rlim_cur - used * page) / 3 : 1;
}

uint64_t pt_free_memory(void)
{
    const uint64_t kib = number_in("/proc/meminfo", "MemAvailable:");
    const uint64_t bounds[] = {kib == UINT64_MAX ? kib : kib << 10, left_of_group(), left_of_addresses()};
    uint64_t least = UINT64_MAX;
    for (size_t i = 0; i < sizeof bounds / sizeof *bounds; i++)
        least = bounds[i] < least ? bounds[i] : least;
    return least == UINT64_MAX ? 0 : least;
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
