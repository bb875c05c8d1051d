/* Linked into Windows libraries in place of the start-up code of a C runtime, which does nothing for plain C
   without static constructors and would take minutes to compile. The functions of C come from ucrtbase.dll. */
#include <stdarg.h>
#include <stddef.h>

int __stdcall DllMainCRTStartup(void *library, unsigned long reason, void *reserved);
int __stdcall DllMainCRTStartup(void *library, unsigned long reason, void *reserved)
{
    (void)library, (void)reason, (void)reserved;
    return 1;
}

/* A frame of more than one page has to touch its pages one after the other, for Windows maps the stack page by page.
   The compiler calls this with the size of the frame in rax, and no register may change. */
__asm__(".text\n"
        ".globl ___chkstk_ms\n"
        "___chkstk_ms:\n"
        "    pushq %rcx\n"
        "    pushq %rax\n"
        "    leaq 24(%rsp), %rcx\n"
        "    cmpq $4096, %rax\n"
        "    jb 2f\n"
        "1:  subq $4096, %rcx\n"
        "    orq $0, (%rcx)\n"
        "    subq $4096, %rax\n"
        "    cmpq $4096, %rax\n"
        "    ja 1b\n"
        "2:  subq %rax, %rcx\n"
        "    orq $0, (%rcx)\n"
        "    popq %rax\n"
        "    popq %rcx\n"
        "    ret\n");

int __cdecl __stdio_common_vsprintf(unsigned long long options, char *text, size_t size, const char *format,
                                    void *locale, va_list arguments);
int vsnprintf(char *text, size_t size, const char *format, va_list arguments);
int vsnprintf(char *text, size_t size, const char *format, va_list arguments)
{
    return __stdio_common_vsprintf(2, text, size, format, NULL, arguments); /* 2: as the C standard has it */
}
