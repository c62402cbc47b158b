// SPDX-License-Identifier: GPL-3.0-or-later
#include "usage.h"
#include "device_gl/device_gl.h"
#include "sanitized.h"
#include "scenes/support.h"

#include <dirent.h>
#include <malloc.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

static char folder[] = "/tmp/patina-soak-XXXXXX";

void usage_begin(void)
{
    assert_non_null(mkdtemp(folder));
    setenv("TMPDIR", folder, 1);
}

void usage_end(void) { rmdir(folder); }

static uint32_t entries(const char *path)
{
    DIR *open = opendir(path);
    uint32_t count = 0;
    if (!open)
        return 0;
    for (const struct dirent *entry; (entry = readdir(open));)
        count += entry->d_name[0] != '.';
    closedir(open);
    return count;
}

// ---- objects of OpenGL -------------------------------------------------------------------------------------------------

static atomic_int alive, lose_after;
static GladGLContext driver;

static void GLAD_API_PTR gen_buffers(GLsizei n, GLuint *names)
{
    driver.GenBuffers(n, names);
    atomic_fetch_add(&alive, n);
}

static void GLAD_API_PTR gen_textures(GLsizei n, GLuint *names)
{
    driver.GenTextures(n, names);
    atomic_fetch_add(&alive, n);
}

static void GLAD_API_PTR gen_queries(GLsizei n, GLuint *names)
{
    driver.GenQueries(n, names);
    atomic_fetch_add(&alive, n);
}

static GLuint GLAD_API_PTR create_program(void)
{
    atomic_fetch_add(&alive, 1);
    return driver.CreateProgram();
}

static GLuint GLAD_API_PTR create_shader(GLenum type)
{
    atomic_fetch_add(&alive, 1);
    return driver.CreateShader(type);
}

static int names_of(GLsizei n, const GLuint *names)
{
    int count = 0;
    for (GLsizei i = 0; i < n; i++)
        count += names[i] != 0;
    return count;
}

static void GLAD_API_PTR delete_buffers(GLsizei n, const GLuint *names)
{
    atomic_fetch_sub(&alive, names_of(n, names));
    driver.DeleteBuffers(n, names);
}

static void GLAD_API_PTR delete_textures(GLsizei n, const GLuint *names)
{
    atomic_fetch_sub(&alive, names_of(n, names));
    driver.DeleteTextures(n, names);
}

static void GLAD_API_PTR delete_queries(GLsizei n, const GLuint *names)
{
    atomic_fetch_sub(&alive, names_of(n, names));
    driver.DeleteQueries(n, names);
}

static void GLAD_API_PTR delete_program(GLuint name)
{
    atomic_fetch_sub(&alive, name != 0);
    driver.DeleteProgram(name);
}

static void GLAD_API_PTR delete_shader(GLuint name)
{
    atomic_fetch_sub(&alive, name != 0);
    driver.DeleteShader(name);
}

void usage_watch(patina_device *device)
{
    struct patina_device_info info = {.struct_size = sizeof info};
    assert_int_equal(patina_device_get_info(device, &info), PATINA_OK);
    assert_int_equal(strncmp(info.name, "gl-", 3), 0);
    GladGLContext *gl = &((struct pt_gl_device *)device)->counter.driver; // its thread waits for a call
    driver = *gl;
    gl->GenBuffers = gen_buffers;
    gl->GenTextures = gen_textures;
    gl->GenQueries = gen_queries;
    gl->CreateProgram = create_program;
    gl->CreateShader = create_shader;
    gl->DeleteBuffers = delete_buffers;
    gl->DeleteTextures = delete_textures;
    gl->DeleteQueries = delete_queries;
    gl->DeleteProgram = delete_program;
    gl->DeleteShader = delete_shader;
}

static GLenum GLAD_API_PTR reset_status(void)
{
    return atomic_fetch_sub(&lose_after, 1) <= 0 ? GL_UNKNOWN_CONTEXT_RESET_ARB : GL_NO_ERROR;
}

void usage_lose_after(patina_device *device, uint32_t checks)
{
    struct pt_gl_device *d = (struct pt_gl_device *)device;
    atomic_store(&lose_after, (int)checks);
    d->gl.KHR_robustness = 0;
    d->gl.ARB_robustness = 1;
    d->gl.GetGraphicsResetStatusARB = reset_status;
}

// ---- the process -------------------------------------------------------------------------------------------------------

struct usage usage_now(void)
{
    malloc_trim(0);
    const struct mallinfo2 heap = mallinfo2();
    struct usage usage = {.heap = heap.uordblks + heap.hblkhd,
                          .handles = entries("/proc/self/fd"),
                          .threads = entries("/proc/self/task"),
                          .files = entries(folder),
                          .objects = (uint32_t)atomic_load(&alive)};
    FILE *file = fopen("/proc/self/statm", "r");
    unsigned long long size, resident, shared; // the last: of files, as code that ran once, which the system may drop
    if (file && fscanf(file, "%llu %llu %llu", &size, &resident, &shared) == 3)
        usage.resident = (resident - shared) * (uint64_t)sysconf(_SC_PAGESIZE);
    if (file)
        fclose(file);
    return usage;
}

static void hold(const char *what, const char *name, uint64_t first, uint64_t last, uint64_t spare)
{
    printf("  %s: %s %llu, then %llu\n", what, name, (unsigned long long)first, (unsigned long long)last);
    if (last > first + first / 100 + spare)
        fail_msg("%s: %s grew from %llu to %llu", what, name, (unsigned long long)first, (unsigned long long)last);
}

void usage_compare(const char *what, const struct usage *first, const struct usage *last)
{
    if (!TEST_SANITIZED)
        hold(what, "bytes of memory", first->heap, last->heap, 0);
    hold(what, "handles", first->handles, last->handles, 0);
    hold(what, "threads", first->threads, last->threads, 0);
    hold(what, "temporary files", first->files, last->files, 0);
    hold(what, "objects of OpenGL", first->objects, last->objects, 0);
    if (!TEST_SANITIZED)
        hold(what, "bytes resident", first->resident, last->resident, 1 << 20); // of which the system keeps no exact account
}

uint32_t soak_count(uint32_t whole)
{
    const char *text = getenv("PATINA_SOAK");
    const double share = text ? strtod(text, NULL) : 1.0, count = whole * share / 100.0;
    return count < 1.0 ? 1 : (uint32_t)count;
}
