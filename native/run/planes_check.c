// SPDX-License-Identifier: GPL-3.0-or-later
// Refuses an image or a light map that is too large before work on it begins: for the device's buffers, or for memory.
#include "planes.h"

// Planes that are given memory: those between passes that run as one are not.
struct made {
    uint8_t plane[PT_PLANE_COUNT][PT_SLOTS];
};

// where: the bytes are needed; what: there is no more than `most` of.
static int fail_large(const struct patina_device *device, const struct pt_plan *plan, uint64_t bytes, const char *where,
                      uint64_t most, const char *what)
{
    const unsigned long long needed = (bytes >> 20) + 1, had = most >> 20;
    const uint32_t *size = plan->crop + 2;
    if (plan->map)
        return pt_fail(&device->handle, PATINA_ERROR_TOO_LARGE,
                       "a light map of %u x %u texels needs %llu MB %s, and %llu MB %s: lower the shadow resolution", size[0],
                       size[1], needed, where, had, what);
    if (plan->panorama)
        return pt_fail(&device->handle, PATINA_ERROR_TOO_LARGE,
                       "a face of the panorama, %u x %u pixels, needs %llu MB %s, and %llu MB %s: make the panorama smaller",
                       size[0], size[1], needed, where, had, what);
    return pt_fail(&device->handle, PATINA_ERROR_TOO_LARGE,
                   "a %u x %u image needs %llu MB %s, and %llu MB %s: render it in regions", size[0], size[1], needed, where,
                   had, what);
}

// made: NULL: all planes are.
static int check_pass(const struct patina_device *device, const struct pt_plan *plan, const struct pt_pass *pass,
                      const struct made *made)
{
    const struct pt_kernel_row *kernel = &pt_kernels[pass->kernel];
    for (uint32_t k = 0; k < pass->ref_count && device->ops->most; k++) {
        const struct pt_ref *ref = &pass->refs[k];
        if (ref->of != PT_OF_FRAME || (made && !made->plane[ref->which][ref->index]))
            continue;
        const uint32_t place = k < kernel->fixed ? k : kernel->fixed + (k - kernel->fixed) % kernel->each;
        const uint64_t bytes = pt_plan_plane_bytes(plan, ref->which, ref->index),
                       most = device->ops->most(device, &kernel->buffers[place]);
        if (bytes > most)
            return fail_large(device, plan, bytes, "in one buffer", most, "are the most that its driver allows");
    }
    return PATINA_OK;
}

int pt_planes_check_pass(const struct patina_device *device, const struct pt_plan *plan, const struct pt_pass *pass)
{
    return check_pass(device, plan, pass, NULL);
}

static int check_passes(const struct patina_device *device, const struct pt_plan *plan)
{
    struct made made = {{{0}}};
    int error = PATINA_OK;
    for (int p = 0; p < PT_PLANE_COUNT; p++)
        for (int k = 0; k < PT_SLOTS; k++)
            made.plane[p][k] = (uint8_t)pt_plane_is_kept((enum pt_plane)p, (uint32_t)k);
    for (uint32_t i = 0; i < plan->life_count; i++)
        made.plane[plan->lives[i].plane][plan->lives[i].index] = 1;
    for (uint32_t i = 0; i < plan->pass_count && !error; i++)
        error = check_pass(device, plan, &plan->passes[i], &made);
    return error;
}

// What there is of memory and what is wanted of it.
struct memory {
    uint64_t wanted, room;
};

// Whether that is more than there is, where this is known; the cap apart.
static int lacks(const struct patina_device *device, uint64_t held, uint64_t bytes, struct memory *memory)
{
    // Asking the system takes some 0.1 ms. Little is not worth that: it may lack all the same, and says so itself.
    enum { LITTLE = 1 << 26 };
    const uint64_t more = bytes > held ? bytes - held : 0;
    if (more < LITTLE)
        return 0;
    memory->room = device->info.hardware ? device->own_memory : pt_free_memory(); // 0: not known
    memory->wanted = device->info.hardware ? bytes : more + more / PT_PLANES_SPARE;
    return memory->room && memory->wanted > memory->room;
}

int pt_planes_lack(const struct patina_device *device, uint64_t held, uint64_t bytes)
{
    struct memory memory;
    return (device->memory_cap && bytes > device->memory_cap) || lacks(device, held, bytes, &memory);
}

int pt_planes_check_memory(const struct patina_device *device, const struct pt_plan *plan, uint64_t held, uint64_t bytes)
{
    struct memory memory;
    if (device->memory_cap && bytes > device->memory_cap)
        return pt_planes_above_cap(device, plan);
    return lacks(device, held, bytes, &memory) ? fail_large(device, plan, memory.wanted, "of memory", memory.room, "are free")
                                               : PATINA_OK;
}

int pt_planes_check(const struct patina_device *device, const struct pt_planes *planes, const struct pt_plan *plan)
{
    const int error = check_passes(device, plan);
    return error ? error : pt_planes_check_memory(device, plan, pt_planes_own(planes), plan->peak);
}
