// SPDX-License-Identifier: GPL-3.0-or-later
// Included before every file of a release build: binds functions that newer glibcs gave a new version to the version
// that glibc 2.28 already had, so that one binary serves every farm node (DESIGN rule 9). A line whose function a
// file does not use leaves no trace in it. `build/test` fails when a newer version slips in.
#if defined(__x86_64__) && defined(__linux__) && !defined(__ASSEMBLER__)
#include <sys/stat.h>
#ifdef __GLIBC__
#define PT_PIN(name, version) __asm__(".symver " #name "," #name "@GLIBC_" version)
// clang-format off
// 2.29: without the error-handling wrapper
PT_PIN(exp, "2.2.5"); PT_PIN(log, "2.2.5"); PT_PIN(pow, "2.2.5"); PT_PIN(exp2, "2.2.5"); PT_PIN(log2, "2.2.5");
// 2.32 .. 2.35
PT_PIN(pthread_sigmask, "2.2.5"); PT_PIN(hypot, "2.2.5"); PT_PIN(hypotf, "2.2.5");
// 2.34: libpthread and libdl became part of libc
PT_PIN(pthread_create, "2.2.5"); PT_PIN(pthread_join, "2.2.5"); PT_PIN(pthread_detach, "2.2.5");
PT_PIN(pthread_once, "2.2.5"); PT_PIN(pthread_key_create, "2.2.5"); PT_PIN(pthread_key_delete, "2.2.5");
PT_PIN(pthread_getspecific, "2.2.5"); PT_PIN(pthread_setspecific, "2.2.5");
PT_PIN(pthread_mutex_trylock, "2.2.5"); PT_PIN(pthread_mutexattr_init, "2.2.5");
PT_PIN(pthread_mutexattr_settype, "2.2.5"); PT_PIN(pthread_mutexattr_destroy, "2.2.5");
PT_PIN(pthread_rwlock_init, "2.2.5"); PT_PIN(pthread_rwlock_destroy, "2.2.5");
PT_PIN(pthread_rwlock_rdlock, "2.2.5"); PT_PIN(pthread_rwlock_wrlock, "2.2.5");
PT_PIN(pthread_rwlock_unlock, "2.2.5"); PT_PIN(pthread_attr_setstacksize, "2.2.5");
PT_PIN(pthread_cancel, "2.2.5"); PT_PIN(pthread_kill, "2.2.5"); PT_PIN(pthread_setname_np, "2.12");
PT_PIN(pthread_condattr_setclock, "2.3.3"); PT_PIN(pthread_setaffinity_np, "2.3.4");
PT_PIN(pthread_getaffinity_np, "2.3.4"); PT_PIN(sem_init, "2.2.5"); PT_PIN(sem_destroy, "2.2.5");
PT_PIN(sem_wait, "2.2.5"); PT_PIN(sem_post, "2.2.5"); PT_PIN(sem_trywait, "2.2.5"); PT_PIN(sem_timedwait, "2.2.5");
PT_PIN(dlopen, "2.2.5"); PT_PIN(dlsym, "2.2.5"); PT_PIN(dlclose, "2.2.5"); PT_PIN(dlerror, "2.2.5");
PT_PIN(dladdr, "2.2.5"); PT_PIN(timer_create, "2.3.3"); PT_PIN(shm_open, "2.2.5");
// clang-format on
#undef PT_PIN

// 2.33: stat and its kin became functions; before, headers called these with the version of struct stat, 1.
int __xstat(int version, const char *path, struct stat *result);
int __fxstat(int version, int descriptor, struct stat *result);
#define stat(path, result) __xstat(1, path, result)
#define fstat(descriptor, result) __fxstat(1, descriptor, result)
#endif
#endif
