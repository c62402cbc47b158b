// SPDX-License-Identifier: GPL-3.0-or-later
// Of platform.h, what is macOS's own (11 and later).
#include "platform.h"

#include <mach/mach.h>
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

uint64_t pt_free_memory(void)
{
    vm_statistics64_data_t pages;
    mach_msg_type_number_t count = HOST_VM_INFO64_COUNT;
    if (host_statistics64(mach_host_self(), HOST_VM_INFO64, (host_info64_t)&pages, &count) != KERN_SUCCESS)
        return 0;
    return ((uint64_t)pages.free_count + pages.inactive_count) * (uint64_t)sysconf(_SC_PAGESIZE);
}

uint64_t pt_file_memory(void)
{
    task_vm_info_data_t about;
    mach_msg_type_number_t count = TASK_VM_INFO_COUNT;
    if (task_info(mach_task_self(), TASK_VM_INFO, (task_info_t)&about, &count) != KERN_SUCCESS)
        return 0;
    return about.external; // bytes of pages that files lie behind
}

const char *pt_error_text(int error, char *buffer, size_t size)
{
    if (strerror_r(error, buffer, size))
        snprintf(buffer, size, "error %d", error);
    return buffer;
}
